"""The published study that this software grew from, run again from its first design to its confirmation, and beyond."""
