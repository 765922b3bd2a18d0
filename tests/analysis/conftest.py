"""Drawn heaps and heaps of spheres whose angle is known."""

from __future__ import annotations

from collections.abc import Callable

import cv2
import numpy as np
import pytest


def draw_heap(
    angle: float = 30.0,
    *,
    half_width: float = 280.0,
    cup: float = 0.0,
    dark: bool = True,
    noise: float = 0.0,
    blur: float = 0.0,
    light: float = 0.0,
    tilt: float = 0.0,
    grains: float = 0.0,
    ground: bool = False,
    size: tuple[int, int] = (560, 800),
    seed: int = 0,
) -> np.ndarray:
    """Draw a wedge of known angle on a cup of height `cup`, as a grey picture; lengths in pixels.

    `grains` is the radius of discs strung along the flanks, `light` the difference in brightness across
    the picture, `tilt` how far the horizontal rises to the right [deg].
    """
    rng = np.random.default_rng(seed)
    rows, columns = size
    middle, base = columns / 2.0, rows * 0.8
    slope = np.tan(np.radians(angle))
    corners = [(-half_width, 0), (-half_width, cup), (0, cup + half_width * slope), (half_width, cup), (half_width, 0)]
    mask = np.zeros(size, np.uint8)
    points = np.array([(middle + x, base - y) for x, y in corners])
    cv2.fillPoly(mask, [np.round(points * 16).astype(np.int32)], 255, cv2.LINE_AA, 4)
    if grains:
        for x in np.arange(-half_width + grains, half_width - grains, 0.8 * grains):
            y = base - cup - (half_width - abs(x)) * slope + rng.uniform(0.0, 0.6 * grains)
            cv2.circle(mask, (round(middle + x), round(y)), round(grains), 255, -1, cv2.LINE_AA)
        mask[round(base) :] = 0
    if ground:
        mask[round(base) :] = 255
    if tilt:
        turn = cv2.getRotationMatrix2D((middle, base), tilt, 1.0)
        border = cv2.BORDER_REPLICATE if ground else cv2.BORDER_CONSTANT
        mask = cv2.warpAffine(mask, turn, (columns, rows), borderMode=border)
    return _shaded(mask / 255.0, dark, (light, blur, noise), rng)


def _shaded(share: np.ndarray, dark: bool, faults: tuple[float, float, float], rng: np.random.Generator) -> np.ndarray:
    light, blur, noise = faults
    paper, ink = (205.0, 70.0) if dark else (55.0, 185.0)
    rows, columns = share.shape
    down, across = np.mgrid[0:rows, 0:columns]
    x, y = across / columns - 0.5, down / rows - 0.5
    picture = paper * (1.0 - share) + ink * share + light * (x + 0.6 * y - x * x - y * y)
    if blur:
        picture = cv2.GaussianBlur(picture, (0, 0), blur)
    picture = picture + rng.normal(0.0, noise, picture.shape) if noise else picture
    return np.clip(picture, 0, 255).astype(np.uint8)


def cone_heap(angle: float, seed: int = 0, *, radius: float = 0.003, cup: float = 0.05, rim: float = 0.03):
    """Return centres and radii of about 1500 spheres filling a cup and a cone of known angle on it [m].

    A close lattice, turned at random and shaken, is cut so that every sphere's top stays under the cone.
    """
    rng = np.random.default_rng(seed)
    step = 2.0 * radius * 1.02
    count = np.arange(-14, 15)
    i, j, k = np.meshgrid(count, count, count, indexing="ij")
    lattice = np.stack([2 * i + (j + k) % 2, np.sqrt(3) * (j + (k % 2) / 3), 2 * np.sqrt(6) / 3 * k], -1).reshape(-1, 3)
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    centres = lattice * step / 2.0 @ turn.T + rng.normal(0.0, 0.15 * radius, lattice.shape)
    distance = np.hypot(centres[:, 0], centres[:, 1])
    slope = np.tan(np.radians(angle))
    # A sphere touches the cone from inside where its centre is radius/cos(angle) below it.
    ceiling = rim + (cup - distance) * slope - radius / np.cos(np.radians(angle))
    inside = (distance < cup - radius) & (centres[:, 2] > radius) & (centres[:, 2] < ceiling)
    return centres[inside], np.full(np.count_nonzero(inside), radius)


@pytest.fixture(scope="session")
def drawn() -> Callable[..., np.ndarray]:
    """The function that draws a heap."""
    return draw_heap


@pytest.fixture(scope="session")
def heap() -> Callable[..., tuple[np.ndarray, np.ndarray]]:
    """The function that piles spheres into a cone."""
    return cone_heap
