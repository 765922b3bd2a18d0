"""Particle shapes, one per file; each is a small type with its own contact search."""

from taichidem.shapes.sphere import Sphere

__all__ = ["Sphere"]
