.PHONY: test
VENV := .venv
