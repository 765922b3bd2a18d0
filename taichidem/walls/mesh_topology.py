"""Which facet answers for which edge and corner of a mesh.

A grain near a fold comes close to several facets at one and the same point. The nearest feature of the whole surface is
decided by signs:

- a facet touches with its face when the centre projects inside it, sign by sign of its three edges;
- an edge counts when the centre lies beyond it for both its facets, and only through its owner (the lower facet);
- a corner counts when the centre lies behind every edge that leaves it, and only through its owner.

Each sign has a slack of a hair, so that rounding lets none be missed where a grain lies straight over an edge or corner;
where two then speak for the same point the contact search lets the first through.

Edges between facets in one plane are no features: there the faces overlap by that hair and the flat patch they belong to
lets one contact through per step, with one memory.
"""

from __future__ import annotations

from collections import defaultdict

import numpy as np


def facet_rows(vertices: np.ndarray, facets: np.ndarray, flat_angle: float) -> list[dict]:
    """Return the kernel rows of a mesh, facets first by number.

    Args:
        vertices: (n, 3) [m], relative to the centre of motion.
        facets: (m, 3) vertex numbers.
        flat_angle: [rad] below which two facets lie in one plane.
    """
    normals = _unit(
        np.cross(vertices[facets[:, 1]] - vertices[facets[:, 0]], vertices[facets[:, 2]] - vertices[facets[:, 0]])
    )
    edges = _edges(facets)
    inward = {key: [_inward(vertices, facets[f], normals[f], key) for f in owners] for key, owners in edges.items()}
    flat = {key: _is_flat(inward[key], flat_angle) for key in edges}
    for key in edges:
        if flat[key]:
            inward[key][1] = -inward[key][0]  # exactly opposite, so that the signs can't disagree
    patches = _patches(len(facets), edges, flat)
    corners = _corners(facets, edges, flat)
    return [_row(f, vertices, facets, normals, edges, inward, flat, patches, corners) for f in range(len(facets))]


def _unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def _edges(facets: np.ndarray) -> dict[tuple[int, int], list[int]]:
    edges: dict[tuple[int, int], list[int]] = defaultdict(list)
    for f, corners in enumerate(facets.tolist()):
        for k in range(3):
            a, b = corners[k], corners[(k + 1) % 3]
            edges[min(a, b), max(a, b)].append(f)
    return edges


def _inward(vertices: np.ndarray, corners: np.ndarray, normal: np.ndarray, key: tuple[int, int]) -> np.ndarray:
    """Return the unit vector in the facet's plane, across an edge, into the facet."""
    along = vertices[key[1]] - vertices[key[0]]
    across = np.cross(normal, along)
    third = next(c for c in corners.tolist() if c not in key)
    return _unit(across if across @ (vertices[third] - vertices[key[0]]) > 0 else -across)


def _is_flat(inward: list[np.ndarray], flat_angle: float) -> bool:
    return len(inward) == 2 and float(np.linalg.norm(inward[0] + inward[1])) < flat_angle


def _patches(count: int, edges: dict, flat: dict) -> np.ndarray:
    """Return the flat patch of each facet, numbered by its lowest facet; −1 for a facet alone in its plane."""
    root = np.arange(count)

    def find(f: int) -> int:
        while root[f] != f:
            root[f] = root[root[f]]
            f = root[f]
        return f

    for key, owners in edges.items():
        if flat[key]:
            a, b = sorted((find(owners[0]), find(owners[1])))
            root[b] = a
    labels = np.array([find(f) for f in range(count)])
    sizes = np.bincount(labels, minlength=count)
    return np.where(sizes[labels] > 1, labels, -1)


def _corners(facets: np.ndarray, edges: dict, flat: dict) -> dict[int, dict]:
    """Return, for each vertex, its owner (lowest facet), its edges, and whether it lies inside a flat face."""
    corners: dict[int, dict] = defaultdict(lambda: {"owner": None, "edges": [], "flat": True})
    for f, triple in enumerate(facets.tolist()):
        for v in triple:
            if corners[v]["owner"] is None:
                corners[v]["owner"] = f
    for key in edges:
        for v in key:
            corners[v]["edges"].append(key)
            corners[v]["flat"] = corners[v]["flat"] and flat[key]
    return corners


def _row(f, vertices, facets, normals, edges, inward, flat, patches, corners) -> dict:  # type: ignore[no-untyped-def]
    triple = facets[f].tolist()
    sides = []
    for k in range(3):
        a, b = triple[k], triple[(k + 1) % 3]
        key = (min(a, b), max(a, b))
        owners = edges[key]
        mine = owners.index(f)
        sides.append(
            {
                "start": vertices[key[0]],
                "end": vertices[key[1]],
                "inward": inward[key][mine],
                "other": inward[key][1 - mine] if len(owners) == 2 else np.zeros(3),
                "flat": int(flat[key]),
                "owned": int(not flat[key] and owners[0] == f),
                "start_corner": triple.index(key[0]),
                "end_corner": triple.index(key[1]),
                "corner_owned": int(not corners[a]["flat"] and corners[a]["owner"] == f),
                "corner_edges": [vertices[e[0] + e[1] - a] - vertices[a] for e in corners[a]["edges"]],
            }
        )
    return {"normal": normals[f], "patch": int(patches[f]), "sides": sides, "corners": vertices[facets[f]]}
