"""Find what a scene needs: kernel rows of its walls, a grid of cells, the size of every table."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np

from taichidem.scene import Scene
from taichidem.state import Sizes
from taichidem.walls import KINDS
from taichidem.walls.mesh_grid import MeshGrid, sort_facets

FACET = "facet"
PACKED = 0.64  # share of the volume that randomly packed spheres fill
DEFAULT_SKIN = 0.4  # of the largest radius: a pour rebuilds its lists every few dozen steps, a settled bed hardly ever


@dataclass
class WorldLayout:
    """What one scene needs of each table."""

    scene: Scene
    wall_rows: list[tuple[int, str, dict]]  # wall number, kind, kernel row
    cell_size: float
    cells: tuple[int, int, int]
    grids: dict[int, MeshGrid]  # by wall number

    @property
    def skin(self) -> float:
        return skin_of(self.scene)

    @property
    def elements(self) -> int:
        return int(np.ceil(self.scene.elements_per_body * self.scene.room))

    @property
    def slots(self) -> int:
        # `partners` is meant for touching spheres; with a reach, a pair is listed by the one that comes first, so each lists
        # half of what a random packing holds within the distance, most where the grains are small. Elements of other forms
        # overlap with the spheres about many more than touch them.
        scene = self.scene
        small = scene.smallest_size
        largest = small if scene.kind == "sphere" else scene.largest_radius
        within = (2 * largest + self.skin + scene.reach()) / small
        packed = 0.5 * PACKED * scene.elements_per_body * within**3
        reached = packed if scene.reach() > 0 or scene.kind != "sphere" else 0.0
        listed = scene.partners + min(reached, self.elements)
        return int(listed * self.elements) + 32

    @property
    def patches(self) -> int:
        return len({(wall, row["patch"]) for wall, kind, row in self.wall_rows if kind == FACET and row["patch"] >= 0})

    def sizes(self) -> Sizes:
        """Return the rows this scene needs in each table."""
        by_kind = Counter(kind for _, kind, _ in self.wall_rows)
        corner_edges = sum(
            len(side["corner_edges"]) for _, kind, row in self.wall_rows if kind == FACET for side in row["sides"]
        )
        return Sizes(
            worlds=1,
            bodies=self.scene.room,
            elements=self.elements,
            slots=self.slots,
            cells=int(np.prod(self.cells)),
            meshes=len(self.grids),
            mesh_cells=sum(len(grid.starts) for grid in self.grids.values()),
            mesh_facets=sum(len(grid.facets) for grid in self.grids.values()),
            walls=len(self.scene.walls),
            wall_elements=len(self.wall_rows) + self.patches,
            planes=by_kind["plane"],
            revolved=by_kind["revolved"],
            facets=by_kind[FACET],
            corner_edges=corner_edges,
            pair_rows=len(self.scene.model.materials) ** 2,
        )


def skin_of(scene: Scene) -> float:
    """Return the margin of a scene's neighbour lists [m]."""
    return DEFAULT_SKIN * scene.largest_radius if scene.skin is None else scene.skin


def lay_out(scene: Scene) -> WorldLayout:
    """Return what a scene needs: kernel rows of its walls (plain kinds first) and a grid of cells."""
    wall_rows = [(number, wall.kind(), row) for number, wall in enumerate(scene.walls) for row in wall.rows()]
    wall_rows.sort(key=lambda item: item[1] == FACET)
    skin = skin_of(scene)
    reach = 2 * scene.largest_radius + skin + scene.reach()
    lower, upper = (np.asarray(corner, float) for corner in scene.domain)
    size = reach
    most = max(4096, 8 * scene.room)
    while np.prod(np.maximum(1, np.floor((upper - lower) / size))) > most:
        size *= 1.2  # a wide domain with few grains needs no finer grid
    x, y, z = (max(1, int(n)) for n in np.floor((upper - lower) / size) + 1)
    near = scene.largest_radius + scene.reach() + skin
    return WorldLayout(scene, wall_rows, size, (x, y, z), _grids(wall_rows, near))


def _grids(wall_rows: list[tuple[int, str, dict]], near: float) -> dict[int, MeshGrid]:
    facets: dict[int, list[dict]] = defaultdict(list)
    for number, kind, row in wall_rows:
        if kind == FACET:
            facets[number].append(row)
    return {
        number: sort_facets(np.array([r["corners"] for r in rows]), np.array([r["normal"] for r in rows]), near)
        for number, rows in facets.items()
    }


def kinds_present(layouts: Sequence[WorldLayout]) -> tuple[type, ...]:
    """Return the wall kinds that the scenes hold; only these are compiled."""
    names = {kind for layout in layouts for _, kind, _ in layout.wall_rows}
    return tuple(kind for kind in KINDS if kind.name in names)


def total_sizes(layouts: Sequence[WorldLayout]) -> Sizes:
    """Return the sizes that hold all scenes together."""
    each = [layout.sizes() for layout in layouts]
    return Sizes(**{f.name: sum(getattr(s, f.name) for s in each) for f in fields(Sizes)})
