"""At a rebuild of the lists new ones inherit what contacts held, and what none inherits goes back to the bodies."""

import taichi as ti

from taichidem.contact import Holding
from taichidem.state import OnTables

INHERITED = -3  # stamp of an old slot whose memory went over into a new list


@ti.data_oriented
class Inheritance(OnTables):
    """The carrying over of memory, and the sharing out of amounts, for laws whose bodies carry one."""

    def __init__(self, state, law, contacts) -> None:
        super().__init__(state)
        self.law = law
        self.contacts = contacts

    @ti.func
    def recall(self, w, e, partner, slot):
        """Copy the memory of a pair that touched in the last evaluation from the old lists, on whichever side it stood."""
        old_e = self.elements[e].came_from
        alive = self.worlds[w].evaluation
        wanted = partner
        if partner >= 0:
            wanted = self.elements[partner].came_from
        sides = 2 if partner >= 0 else 1  # a wall never owns a pair
        for side in range(sides):
            owner, other = old_e, wanted
            if side == 1:
                owner, other = wanted, old_e
            for s in range(self.elements[owner].slots_from, self.elements[owner].slots_to):
                if self.slots[s].partner == other and self.slots[s].stamp == alive:
                    self.law.carry(s, slot, ti.cast(side, ti.f64))
                    if ti.static(not self.single):
                        self.contacts.pushes.pair_of[slot].mass = self.contacts.pushes.pair_of[s].mass
                    if ti.static(self.kind == "superquadric"):
                        self.axes[slot].axis = (1.0 - 2.0 * side) * self.axes[s].axis
                        radius_i, radius_j = self.axes[s].radius_i, self.axes[s].radius_j
                        self.axes[slot].radius_i = radius_j if side == 1 else radius_i
                        self.axes[slot].radius_j = radius_i if side == 1 else radius_j
                    self.slots[slot].stamp = alive
                    if ti.static(self.carries):
                        self.slots[s].stamp = INHERITED

    @ti.func
    def give_back(self, w):
        """Let bodies take back what contacts held that no new list inherits: what parted too far, left, or lost its wall.

        On one thread, since several contacts may give to one body.
        """
        alive = self.worlds[w].evaluation
        base = 2 * self.worlds[w].first_element + self.worlds[w].element_capacity - self.worlds[w].element_base
        for e in range(base, base + self.worlds[w].elements_before):
            for s in range(self.elements[e].slots_from, self.elements[e].slots_to):
                if self.slots[s].stamp == alive:
                    self._share_out(e, s)

    @ti.func
    def _share_out(self, e, s):
        """Give what an old slot holds to its two bodies, all of it to the one that stays where the other has left."""
        partner = self.slots[s].partner
        h = Holding(held_i=0.0)
        self.law.release(s, h, partner < 0)
        first = self.labels[self.contacts.body_of(e)].moved_to
        second = -1
        if partner >= 0:
            second = self.labels[self.contacts.body_of(partner)].moved_to
        given_i, given_j = h.change_i, h.change_j
        if first < 0:
            given_i, given_j = 0.0, given_i + given_j
        elif second < 0:
            given_i, given_j = given_i + given_j, 0.0
        if first >= 0:
            self.amounts[first].held = self.amounts[first].held + given_i
        if second >= 0:
            self.amounts[second].held = self.amounts[second].held + given_j
