"""Pluggable analysers of run tables, and heap-image analysis."""
