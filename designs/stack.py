"""Putting groups of points on top of one another."""

from __future__ import annotations

import numpy as np

from designs.base import Points
from designs.space import Array


def stacked(*groups: tuple[str, Array], notes: tuple[str, ...] = ()) -> Points:
    """Return the points of several groups, each given as (point type, coded values of shape (n, k))."""
    kinds = tuple(kind for kind, points in groups for _ in range(len(points)))
    return Points(np.vstack([points for _, points in groups]), kinds, notes=notes)


def stacked_blocks(blocks: list[list[tuple[str, Array]]], notes: tuple[str, ...] = ()) -> Points:
    """Return the points of several blocks, numbered from 1, each a list of (point type, coded values)."""
    parts = [stacked(*groups) for groups in blocks]
    number = np.concatenate([np.full(len(part.coded), i + 1, dtype=np.int64) for i, part in enumerate(parts)])
    kinds = tuple(kind for part in parts for kind in part.point_type)
    return Points(np.vstack([part.coded for part in parts]), kinds, block=number, notes=notes)
