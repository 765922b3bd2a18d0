"""Particle shapes: what a user says of a form, and the contact search that goes with it."""

from taichidem.shapes.base import Elements, GrainShape
from taichidem.shapes.forms import Forms
from taichidem.shapes.multisphere import Multisphere
from taichidem.shapes.spheroid_spheres import ShapeError
from taichidem.shapes.superquadric import Superquadric

__all__ = ["Elements", "Forms", "GrainShape", "Multisphere", "ShapeError", "Superquadric"]
