"""taichidem: a discrete-element simulator that compares a model with measurements and finds the missing effect."""

__version__ = "0.1.0"
