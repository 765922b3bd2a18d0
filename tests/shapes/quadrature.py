"""Volumes and moments by numerical integration, with nothing of the code under test in them."""

import itertools
import math

import numpy as np


def gauss(low, high, count=60):
    """Return nodes and weights of a Gauss–Legendre rule."""
    x, w = np.polynomial.legendre.leggauss(count)
    return low + (high - low) * (x + 1) / 2, w * (high - low) / 2


def double_exponential(low, high, count=161, reach=3.4):
    """Return nodes and weights of a tanh–sinh rule, which roots and powers at the ends don't disturb."""
    t = np.linspace(-reach, reach, count)
    u = 0.5 * math.pi * np.sinh(t)
    weight = 0.5 * math.pi * np.cosh(t) / np.cosh(u) ** 2 * (t[1] - t[0])
    return low + (high - low) / (1 + np.exp(-2 * u)), weight * (high - low) / 2


def star(reach, polar, turn):
    """Return volume, ∫ x dV (3,), ∫ x xᵀ dV (3, 3) of a body whose surface is at reach(directions) from 0.

    Args:
        reach: function of unit vectors (n, 3).
        polar, turn: rules (nodes, weights) for the angle from z and the angle about it.
    """
    (theta, w_theta), (phi, w_phi) = polar, turn
    theta, phi = np.meshgrid(theta, phi, indexing="ij")
    direction = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], -1).reshape(-1, 3)
    weight = (np.sin(theta) * w_theta[:, None] * w_phi).reshape(-1)
    r = reach(direction)
    first = (weight * r**4 / 4) @ direction
    second = np.einsum("n,ni,nj->ij", weight * r**5 / 5, direction, direction)
    return float(weight @ r**3 / 3), first, second


def on_a_line(z, radii):
    """Return volume, centre and moments over the mass (across, along) of the union of spheres at z on an axis."""
    z, radii = np.asarray(z, float), np.asarray(radii, float)
    ends = [*(z - radii), *(z + radii)]
    for i in range(len(z)):
        for j in range(i):
            if z[i] != z[j]:
                ends.append((radii[j] ** 2 - radii[i] ** 2 + z[i] ** 2 - z[j] ** 2) / (2 * (z[i] - z[j])))
    ends = np.unique(ends)
    rules = [gauss(low, high, 6) for low, high in itertools.pairwise(ends)]
    at, weight = (np.concatenate(parts) for parts in zip(*rules, strict=True))
    square = np.maximum(radii**2 - (at[:, None] - z) ** 2, 0).max(axis=1)
    area = math.pi * square * weight
    volume = area.sum()
    centre = area @ at / volume
    along = area @ square / 2 / volume
    return volume, centre, along / 2 + area @ (at - centre) ** 2 / volume, along


def inertia(volume, first, second):
    """Return the tensor of inertia over the mass about the centre of mass."""
    centre = first / volume
    about = second / volume - np.outer(centre, centre)
    return np.trace(about) * np.eye(3) - about
