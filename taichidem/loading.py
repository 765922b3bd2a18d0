"""Put scenes into an engine: write walls, coefficients and what each world is like."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Sequence

import numpy as np

from taichidem.engine import Engine
from taichidem.errors import CompositionError
from taichidem.scene import Scene
from taichidem.walls import Wall
from taichidem.world_layout import FACET, WorldLayout

CURVATURE_TIME = 200.0  # Rayleigh times in which R* of superquadrics follows the curvature; an impact lasts some six


def check_alike(scenes: Sequence[Scene]) -> None:
    """Raise CompositionError unless all scenes can run in one engine."""
    compositions = {tuple(sorted(map(repr, composition(scene)))) for scene in scenes}
    if len(compositions) > 1:
        raise CompositionError(
            f"The scenes hold different effects ({' | '.join(map(str, sorted(compositions)))}); worlds of one simulation "
            "share one compiled law. Give each scene the same effects; a strength may be at its vanishing value."
        )


def composition(scene: Scene) -> tuple:
    """Return what the compiled law of a scene depends on."""
    return tuple(sorted((e.composition for e in scene.model.acting().effects), key=repr))


class Loader:
    """Write scenes into the tables of an engine, world by world."""

    def __init__(self, engine: Engine) -> None:
        self.engine = engine
        self.access = engine.access
        self.next: dict[str, int] = defaultdict(int)

    def load(self, world: int, layout: WorldLayout) -> None:
        """Write one scene as world number `world` (worlds must come in order)."""
        first_wall, first_element = self._write_walls(layout)
        first_row = self._write_coefficients(world, layout.scene)
        self._write_world(world, layout, first_wall, first_element, first_row)

    def _take(self, name: str, count: int) -> int:
        first = self.next[name]
        self.next[name] += count
        return first

    def _write_world(
        self, world: int, layout: WorldLayout, first_wall: int, first_element: int, first_row: int
    ) -> None:
        scene = layout.scene
        plain = sum(kind != FACET for _, kind, _ in layout.wall_rows)
        x, y, z = layout.cells
        first_body = 2 * self._take("body", scene.room)
        first_owned = first_body if self.engine.single else 2 * self._take("element", layout.elements)
        first_slot = 2 * self._take("slot", layout.slots)
        values = {
            "first_body": first_body,
            "body_capacity": scene.room,
            "body_base": first_body,
            "first_element": first_owned,
            "element_capacity": scene.room if self.engine.single else layout.elements,
            "element_base": first_owned,
            "first_slot": first_slot,
            "slot_capacity": layout.slots,
            "slot_base": first_slot,
            "lower": np.asarray(scene.domain[0], float),
            "upper": np.asarray(scene.domain[1], float),
            "cell_size": layout.cell_size,
            "first_cell": self._take("cell", x * y * z + 1),
            "cells_x": x,
            "cells_y": y,
            "cells_z": z,
            "first_wall": first_wall,
            "walls": len(scene.walls),
            "first_wall_element": first_element,
            "wall_elements": len(layout.wall_rows) + layout.patches,
            "plain_elements": plain,
            "first_mesh": self.next["mesh"] - len(layout.grids),
            "meshes": len(layout.grids),
            "first_row": first_row,
            "materials": len(scene.model.materials),
            "dt": scene.dt,
            "curvature_share": -math.expm1(-scene.dt / (CURVATURE_TIME * scene.rayleigh_time())),
            "skin": layout.skin,
            "reach": scene.reach(),
            "largest_radius": scene.largest_radius,
        }
        self.access["worlds"].write(world, [values])

    def _write_coefficients(self, world: int, scene: Scene) -> int:
        own: dict = {e.composition: e for e in scene.model.acting().effects}
        pairs = scene.model.pairs()
        first = self._take("row", len(pairs))
        for bound, access in zip(self.engine.law.contact_bound, self.access["contact"], strict=True):
            effect = own[bound.effect.composition]
            access.write(first, [effect.kernel_coefficients(p) if scene.can_touch(p) else {} for p in pairs])
        for bound, access in zip(self.engine.law.body_bound, self.access["body"], strict=True):
            access.write(world, [own[bound.effect.composition].kernel_coefficients()])
        return first

    def _write_walls(self, layout: WorldLayout) -> tuple[int, int]:
        scene = layout.scene
        first_wall = self._take("wall", len(scene.walls))
        self.access["walls"].write(
            first_wall, [wall_row(scene.model.material_number(w.material), w) for w in scene.walls]
        )
        first = self._take("wall_element", len(layout.wall_rows) + layout.patches)
        patches: dict[tuple[int, int], int] = {}
        elements: list[dict] = []
        geometry: dict[str, list[dict]] = defaultdict(list)
        kinds = [kind.name for kind in self.engine.wall_kinds]
        for number, kind, values in layout.wall_rows:
            patch = -1
            if kind == FACET and values["patch"] >= 0:
                key = (number, values["patch"])
                patch = patches.setdefault(key, first + len(layout.wall_rows) + len(patches))
            row = self.next[kind] + len(geometry[kind])
            geometry[kind].append(values)
            elements.append({"kind": kinds.index(kind), "row": row, "wall": first_wall + number, "patch": patch})
        elements += [{"kind": -1, "row": -1, "wall": first_wall + number, "patch": -1} for number, _ in patches]
        self.access["wall_elements"].write(first, elements)
        self._write_sides([side for row in geometry.get(FACET, []) for side in row["sides"]])
        for kind, rows in geometry.items():
            self.access[kind].write(self._take(kind, len(rows)), rows)
        self._write_meshes(layout, first_wall, first)
        return first_wall, first

    def _write_meshes(self, layout: WorldLayout, first_wall: int, first_element: int) -> None:
        for number, grid in layout.grids.items():
            own = [
                first_element + k
                for k, (wall, kind, _) in enumerate(layout.wall_rows)
                if wall == number and kind == FACET
            ]
            first_cell = self._take("mesh_cell", len(grid.starts))
            first_facet = self._take("mesh_facet", len(grid.facets))
            x, y, z = grid.cells
            row = {
                "wall": first_wall + number,
                "lower": grid.lower,
                "cell_size": grid.cell_size,
                "first_cell": first_cell,
            }
            self.access["meshes"].write(self._take("mesh", 1), [row | {"cells_x": x, "cells_y": y, "cells_z": z}])
            self.access["mesh_cells"].write_column(first_cell, "start", first_facet + grid.starts)
            self.access["mesh_facets"].write_column(first_facet, "element", np.array(own)[grid.facets])

    def _write_sides(self, sides: list[dict]) -> None:
        """Write the sides of all facets of a world, and the edges that leave their corners."""
        edges = [along for side in sides for along in side["corner_edges"]]
        first = self._take("corner", len(edges))
        ends = first + np.cumsum([len(side["corner_edges"]) for side in sides], dtype=int)
        rows = [
            side | {"corner_first": end - len(side["corner_edges"]), "corner_last": end}
            for side, end in zip(sides, ends.tolist(), strict=True)
        ]
        self.access["sides"].write(3 * self.next[FACET], rows)
        self.access["corner_edges"].write(first, [{"along": along} for along in edges])


def wall_row(material: int, wall: Wall) -> dict:
    """Return the kernel row of a wall's rigid motion."""
    return motion_columns(wall) | {
        "origin": wall.motion.centre,
        "first_row": (1.0, 0.0, 0.0),
        "second_row": (0.0, 1.0, 0.0),
        "third_row": (0.0, 0.0, 1.0),
        "removed_at": wall.removed_at,
        "material": material,
        "turned": 0,
    }


def motion_columns(wall: Wall) -> dict:
    """Return what a wall's motion says, but for where the wall is."""
    load = np.asarray(wall.motion.load, float)
    size = float(np.linalg.norm(load))
    return {
        "velocity": wall.motion.velocity,
        "spin": wall.motion.spin,
        "load": size,
        "guide": load / size if size else load,
        "inverse_mass": 1 / wall.motion.mass if size else 0.0,
        "extent": wall.extent() if any(wall.motion.spin) else 0.0,
        "moves": int(wall.motion.moves),
    }
