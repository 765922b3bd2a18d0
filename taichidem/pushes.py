"""How much mass a contact has to stop, where bodies are composed of spheres and may touch at several points at once.

A dashpot that realises a coefficient of restitution is made for the mass that the contact alone decelerates. Two bodies that
touch at k points share theirs among them: with the whole mass at each point they would rebound with the coefficient of a
dashpot √k times as strong. So every contact asks how a push along the normals of all contacts between the two bodies moves
its own point, 1/m = Σ_b n_a·(1/m_i + 1/m_j) n_b + (r_a × n_a)·I⁻¹ Σ_b (r_b × n_b), summed as of the last evaluation.
"""

import taichi as ti

from taichidem.contact import applied, vec3
from taichidem.state import OnTables


@ti.data_oriented
class Pushes(OnTables):
    """The sums over the contacts between two bodies, or between a body and a wall."""

    def __init__(self, state) -> None:
        super().__init__(state)
        self.pairs, self.pushes, self.pair_of = state.pairs, state.pushes, state.pair_of

    @ti.func
    def group(self, w):
        """Find, for every slot of freshly built lists, the pair of bodies it stands for; on one thread."""
        base = self.worlds[w].body_base
        for i in range(base, base + self.worlds[w].bodies):
            self.labels[i].pairs_from = -1
        free = self.worlds[w].slot_base
        base = self.worlds[w].element_base
        for e in range(base, base + self.worlds[w].elements):
            for s in range(self.elements[e].slots_from, self.elements[e].slots_to):
                first, other = self._bodies_of(e, self.slots[s].partner)
                k = self.labels[first].pairs_from
                while k >= 0 and self.pairs[k].other != other:
                    k = self.pairs[k].next
                if k < 0:
                    k = free
                    free += 1
                    self.pairs[k].other = other
                    self.pairs[k].next = self.labels[first].pairs_from
                    self.labels[first].pairs_from = k
                    self.pushes[2 * k].stamp = -2
                    self.pushes[2 * k + 1].stamp = -2
                self.pair_of[s].pair = k

    @ti.func
    def _bodies_of(self, e, partner):
        """Return the body that lists the pair, the one with the lower row, and the other body or −1 − wall."""
        first = self.owned[e].body
        other = -1
        if partner >= 0:
            other = ti.max(first, self.owned[partner].body)
            first = ti.min(first, self.owned[partner].body)
        else:
            other = -1 - self.wall_elements[-1 - partner].wall
        return first, other

    @ti.func
    def mass(self, slot, i, j, with_body, c, evaluation, is_new):
        """Return the mass that a contact has to stop [kg].

        Args:
            slot: of the contact.
            i, j: bodies; `with_body` is 0 at a wall.
            is_new: 1 if it was not there in the last evaluation.
        """
        row = 2 * self.pair_of[slot].pair + (evaluation - 1) % 2
        summed = self.pushes[row].stamp == evaluation - 1
        normal, turn_i, turn_j = vec3(0.0), vec3(0.0), vec3(0.0)
        if summed:
            normal, turn_i, turn_j = self.pushes[row].normal, self.pushes[row].turn_first, self.pushes[row].turn_second
            if with_body == 1 and i > j:
                normal, turn_i, turn_j = -normal, turn_j, turn_i
        own_i, own_j = c.lever_i.cross(c.normal), c.normal.cross(c.lever_j)
        if is_new == 1 or not summed:
            normal, turn_i, turn_j = normal + c.normal, turn_i + own_i, turn_j + own_j
        least = self.bodies[i].inverse_mass
        inverse = own_i.dot(applied(self.rotors[i].mobility, turn_i))
        if with_body == 1:
            least += self.bodies[j].inverse_mass
            inverse += own_j.dot(applied(self.rotors[j].mobility, turn_j))
        inverse += least * c.normal.dot(normal)
        mass = 1.0 / ti.max(inverse, least)
        if not summed and is_new == 0 and self.pair_of[slot].mass > 0.0:
            mass = self.pair_of[slot].mass  # lists were built anew since, and hold no sums yet
        self.pair_of[slot].mass = mass
        return mass

    @ti.func
    def note(self, slot, i, j, with_body, normal, turn_i, turn_j, evaluation):
        """Add a contact to the sums of this evaluation; one thread per world may call this."""
        row = 2 * self.pair_of[slot].pair + evaluation % 2
        if self.pushes[row].stamp != evaluation:
            self.pushes[row].stamp = evaluation
            self.pushes[row].normal = vec3(0.0)
            self.pushes[row].turn_first = vec3(0.0)
            self.pushes[row].turn_second = vec3(0.0)
        if with_body == 1 and i > j:
            self.pushes[row].normal = self.pushes[row].normal - normal
            self.pushes[row].turn_first = self.pushes[row].turn_first + turn_j
            self.pushes[row].turn_second = self.pushes[row].turn_second + turn_i
        else:
            self.pushes[row].normal = self.pushes[row].normal + normal
            self.pushes[row].turn_first = self.pushes[row].turn_first + turn_i
            self.pushes[row].turn_second = self.pushes[row].turn_second + turn_j
