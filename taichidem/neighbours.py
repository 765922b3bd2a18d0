"""Neighbour lists: sort grains by cell, list the pairs that may touch, carry contact memory over.

A list holds until some grain has moved half the skin since it was built. Each rebuild drops bodies that left the domain
or lost a finite position, puts the rest in the order of their cells (neighbours in space are neighbours in memory),
lists each pair once, at the element that comes first, and copies the memory of pairs that touched.
"""

import taichi as ti

from taichidem.contact import vec3
from taichidem.inheritance import Inheritance
from taichidem.state import OnTables, Status


@ti.data_oriented
class Neighbours(OnTables):
    """The rebuild of one world's lists; all of it runs on one thread unless the engine spreads `fill`."""

    def __init__(self, state, law, contacts, wall_motion) -> None:
        super().__init__(state)
        self.cells, self.mesh_facets = state.cells, state.mesh_facets
        self.law = law
        self.contacts = contacts
        self.wall_motion = wall_motion
        self.inheritance = Inheritance(state, law, contacts)

    @ti.func
    def stale(self, w, e):
        """Return 1 if an element moved so far that the lists may miss a pair; a position that is no number counts too."""
        moved = self.contacts.place(e).position - self.elements[e].listed_at
        slack = 0.5 * self.worlds[w].skin
        fresh = moved.dot(moved) <= slack * slack
        return 0 if fresh else 1

    @ti.func
    def cell_of(self, w, position):
        """Return the cell of a position, clamped to the domain."""
        at = (position - self.worlds[w].lower) / self.worlds[w].cell_size
        x = ti.min(ti.max(int(ti.floor(at[0])), 0), self.worlds[w].cells_x - 1)
        y = ti.min(ti.max(int(ti.floor(at[1])), 0), self.worlds[w].cells_y - 1)
        z = ti.min(ti.max(int(ti.floor(at[2])), 0), self.worlds[w].cells_z - 1)
        return (z * self.worlds[w].cells_y + y) * self.worlds[w].cells_x + x

    @ti.func
    def cell_count(self, w):
        """Return the number of cells of a world."""
        return self.worlds[w].cells_x * self.worlds[w].cells_y * self.worlds[w].cells_z

    @ti.func
    def inside(self, w, position):
        """Return 1 for a finite position within the domain."""
        stays = 1
        for axis in ti.static(range(3)):
            within = position[axis] >= self.worlds[w].lower[axis] and position[axis] <= self.worlds[w].upper[axis]
            if not within:
                stays = 0
        return stays

    @ti.func
    def _clear_cells(self, w):
        first = self.worlds[w].first_cell
        for c in range(first, first + self.cell_count(w) + 1):
            self.cells[c].start = 0

    @ti.func
    def _sum_cells(self, w):
        """Turn counts into first rows relative to the world's base, and set the cursors."""
        first = self.worlds[w].first_cell
        running = 0
        for c in range(first, first + self.cell_count(w) + 1):
            count = self.cells[c].start
            self.cells[c].start = running
            self.cells[c].cursor = running
            running += count

    @ti.func
    def _sort_bodies(self, w):
        """Drop lost bodies and move the others into the idle half, in the order of their cells."""
        base = self.worlds[w].body_base
        count = self.worlds[w].bodies
        first = self.worlds[w].first_body
        first_cell = self.worlds[w].first_cell
        idle = 2 * first + self.worlds[w].body_capacity - base  # first rows of the halves add up to this
        dt, farthest = self.worlds[w].dt, self.worlds[w].largest_radius
        self._clear_cells(w)
        kept = 0
        for i in range(base, base + count):
            position = self.bodies[i].position
            self.labels[i].cell = -1
            # Written so that what is no number counts as too far and too fast.
            if not (self.bodies[i].velocity.norm() * dt <= farthest and position.dot(position) < 1e300):
                self.worlds[w].status = int(Status.DIVERGED)
            elif self.inside(w, position) == 1:
                cell = self.cell_of(w, position)
                self.labels[i].cell = cell
                self.cells[first_cell + cell].start = self.cells[first_cell + cell].start + 1
                kept += 1
        self._sum_cells(w)
        for i in range(base, base + count):
            self.labels[i].moved_to = -1
            cell = self.labels[i].cell
            if cell >= 0:
                new = idle + self.cells[first_cell + cell].cursor
                self.cells[first_cell + cell].cursor = self.cells[first_cell + cell].cursor + 1
                self.labels[i].moved_to = new
                self._copy_body(i, new)
        self.worlds[w].left = self.worlds[w].left + count - kept
        self.worlds[w].bodies = kept
        self.worlds[w].body_base = idle

    @ti.func
    def _copy_body(self, old, new):
        self.bodies[new] = self.bodies[old]
        self.labels[new].identity = self.labels[old].identity
        self.labels[new].radius = self.labels[old].radius
        if ti.static(self.carries):
            self.amounts[new].held = self.amounts[old].held
        if ti.static(not self.round):
            self.rotors[new] = self.rotors[old]
        if ti.static(self.kind == "superquadric"):
            self.forms[new] = self.forms[old]
        if ti.static(self.single):
            self._copy_element(old, new)

    @ti.func
    def _copy_element(self, old, new):
        self.loads[new] = self.loads[old]
        self.elements[new].radius = self.elements[old].radius
        self.elements[new].material = self.elements[old].material
        self.elements[new].came_from = old

    @ti.func
    def _sort_elements(self, w):
        """Do for the elements of composed bodies what `_sort_bodies` does for bodies."""
        if ti.static(self.single):
            self.worlds[w].element_base = self.worlds[w].body_base
            self.worlds[w].elements = self.worlds[w].bodies
        else:
            base = self.worlds[w].element_base
            count = self.worlds[w].elements
            first_cell = self.worlds[w].first_cell
            idle = 2 * self.worlds[w].first_element + self.worlds[w].element_capacity - base
            self._clear_cells(w)
            kept = 0
            for e in range(base, base + count):
                self.elements[e].cell = -1
                if self.labels[self.owned[e].body].moved_to >= 0:
                    cell = self.cell_of(w, self.owned[e].position)
                    self.elements[e].cell = cell
                    self.cells[first_cell + cell].start = self.cells[first_cell + cell].start + 1
                    kept += 1
            self._sum_cells(w)
            for e in range(base, base + count):
                cell = self.elements[e].cell
                if cell >= 0:
                    new = idle + self.cells[first_cell + cell].cursor
                    self.cells[first_cell + cell].cursor = self.cells[first_cell + cell].cursor + 1
                    self._copy_element(e, new)
                    self.owned[new] = self.owned[e]
                    self.owned[new].body = self.labels[self.owned[e].body].moved_to
            self.worlds[w].elements = kept
            self.worlds[w].element_base = idle

    @ti.func
    def prepare(self, w):
        """Sort bodies and elements; the pair lists are empty until `fill` has run."""
        self.worlds[w].rebuilds = self.worlds[w].rebuilds + 1
        self.worlds[w].elements_before = self.worlds[w].elements
        self.worlds[w].wall_travel = 0.0
        self._sort_bodies(w)
        self._sort_elements(w)
        half = self.worlds[w].slot_capacity
        self.worlds[w].slot_base = 2 * self.worlds[w].first_slot + half - self.worlds[w].slot_base

    @ti.func
    def build(self, w):
        """Rebuild a world's lists on one thread."""
        self.prepare(w)
        cursor = self.worlds[w].slot_base
        base = self.worlds[w].element_base
        for e in range(base, base + self.worlds[w].elements):
            cursor = self.fill(w, e, cursor, True)
        self.worlds[w].slots = cursor - self.worlds[w].slot_base
        self.finish(w)

    @ti.func
    def finish(self, w):
        """Do what needs the lists whole, and one thread."""
        if ti.static(not self.single):
            self.contacts.pushes.group(w)
        if ti.static(self.carries):
            self.inheritance.give_back(w)

    @ti.func
    def fill(self, w, e, begin, write: ti.template()):
        """List the partners of an element from row `begin`, or only count them; return the row after the last."""
        a = self.contacts.place(e)
        cursor = begin
        if ti.static(write):
            self.elements[e].listed_at = a.position
            self.elements[e].slots_from = begin
        cell = self.cell_of(w, a.position)
        across = self.worlds[w].cells_x
        x = cell % across
        y = (cell // across) % self.worlds[w].cells_y
        z = cell // (across * self.worlds[w].cells_y)
        base = self.worlds[w].element_base
        first_cell = self.worlds[w].first_cell
        margin = self.worlds[w].reach + self.worlds[w].skin
        # Rows of cells along x are contiguous in memory; elements before e have listed their pairs with it themselves.
        for dz in range(0, 2):
            for dy in range(-1, 2):
                ahead = dz > 0 or dy >= 0
                within = z + dz < self.worlds[w].cells_z and y + dy >= 0 and y + dy < self.worlds[w].cells_y
                if ahead and within:
                    line = ((z + dz) * self.worlds[w].cells_y + y + dy) * across
                    start = base + self.cells[first_cell + line + ti.max(x - 1, 0)].start
                    end = base + self.cells[first_cell + line + ti.min(x + 1, across - 1) + 1].start
                    if dz == 0 and dy == 0:
                        start = e + 1
                    for other in range(start, end):
                        b = self.contacts.place(other)
                        apart = a.position - b.position
                        limit = a.radius + b.radius + margin
                        if apart.dot(apart) < limit * limit and self._distinct(e, other):
                            cursor = self._add(w, e, other, self.elements[other].material, cursor, write)
        cursor = self._fill_walls(w, e, a, margin, cursor, write)
        if ti.static(write):
            self.elements[e].slots_to = cursor
        return cursor

    @ti.func
    def _distinct(self, e, other):
        return self.contacts.body_of(e) != self.contacts.body_of(other) or ti.static(self.single)

    @ti.func
    def _fill_walls(self, w, e, a, margin, begin, write: ti.template()):
        cursor = begin
        first = self.worlds[w].first_wall_element
        plain = self.worlds[w].plain_elements
        time = self.worlds[w].step * self.worlds[w].dt
        # Plain walls are looked at by every grain; of a mesh only the facets near the grain's place in the mesh's grid.
        for unit in range(plain + self.worlds[w].meshes):
            start, end = 0, 1
            if unit >= plain:
                start, end = self.wall_motion.facets_near(self.worlds[w].first_mesh + unit - plain, a.position)
            for k in range(start, end):
                element = first + unit
                if unit >= plain:
                    element = self.mesh_facets[k].element
                if self.wall_motion.nearest(element, a.position, a.radius, time).distance < a.radius + margin:
                    material = self.walls[self.wall_elements[element].wall].material
                    patch = self.wall_elements[element].patch
                    if patch >= 0 and self._listed(begin, cursor, -1 - patch, write) == 0:
                        cursor = self._add(w, e, -1 - patch, material, cursor, write)
                    cursor = self._add(w, e, -1 - element, material, cursor, write)
        return cursor

    @ti.func
    def _listed(self, begin, end, partner, write: ti.template()):
        """Return 1 if a partner is listed already; while only counting nothing is, so counts are upper bounds."""
        found = 0
        if ti.static(write):
            for s in range(begin, end):
                if self.slots[s].partner == partner:
                    found = 1
        return found

    @ti.func
    def _add(self, w, e, partner, material, cursor, write: ti.template()):
        if ti.static(write):
            if cursor < self.worlds[w].slot_base + self.worlds[w].slot_capacity:
                row = self.elements[e].material * self.worlds[w].materials + material
                self.slots[cursor].partner = partner
                self.slots[cursor].row = self.worlds[w].first_row + row
                self.slots[cursor].stamp = -2
                inverse_mass = self.bodies[self.contacts.body_of(e)].inverse_mass
                radius = 0.0
                if partner >= 0:
                    inverse_mass += self.bodies[self.contacts.body_of(partner)].inverse_mass
                    radius = self.elements[partner].radius
                self.slots[cursor].mass = 1.0 / inverse_mass
                self.slots[cursor].radius = self.contacts.shape.pair_radius(self.elements[e].radius, radius)
                if ti.static(self.kind == "superquadric"):
                    self.axes[cursor].axis = vec3(0.0)
                if ti.static(not self.single):
                    self.contacts.pushes.pair_of[cursor].mass = 0.0
                self.inheritance.recall(w, e, partner, cursor)
            else:
                self.worlds[w].status = int(Status.LIST_FULL)
        return ti.min(cursor + 1, self.worlds[w].slot_base + self.worlds[w].slot_capacity)
