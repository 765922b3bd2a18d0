"""The command line: one module per command or family of commands, and what they share."""

from taichidem.cli.application import main

__all__ = ["main"]
