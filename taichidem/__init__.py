"""taichidem: a discrete-element simulator that compares a model with measurements and finds the missing effect."""

import os

# Before anything imports Taichi: no banner on standard output, which belongs to results.
os.environ.setdefault("ENABLE_TAICHI_HEADER_PRINT", "0")

__version__ = "0.1.0"
