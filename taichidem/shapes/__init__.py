"""Particle shapes: what a user says of a form, and the contact search that goes with it."""

from taichidem.shapes.base import Elements, GrainShape
from taichidem.shapes.forms import Forms
from taichidem.shapes.superquadric import Superquadric

__all__ = ["Elements", "Forms", "GrainShape", "Superquadric"]
