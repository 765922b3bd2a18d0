"""How much of the paper's study is run: softened grains within an hour, or the real stiffness within a day."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Effort:
    """What a reproduction costs.

    Attributes:
        name: quick or full.
        stiffness: Young's modulus as a share of the real one; steps are 1/√stiffness times as large.
        screening: heaps per run of the Plackett–Burman design.
        surface: heaps per run of the composite design; one for each run of a point that has as many runs.
        search: heaps of 6 mm per round of the search for the optimum.
        confirmation: heaps of 6 mm per confirmation of a setting.
        fine: heaps of 3 mm there.
        held_out: seeds of the tests that the model was not fitted to.
    """

    name: str
    stiffness: float
    screening: int
    surface: int
    search: int
    confirmation: int
    fine: int
    held_out: int


# 10 MPa for 1.3 GPa. Not softer: 5 MPa lowers the heaps by 0.7° ± 0.2° (docs/reproduce_paper.md).
SOFT = 1 / 130
# Heaps of 6 mm in fours, which fill two threads.
QUICK = Effort("quick", stiffness=SOFT, screening=1, surface=2, search=4, confirmation=16, fine=2, held_out=2)
FULL = Effort("full", stiffness=1.0, screening=2, surface=3, search=12, confirmation=24, fine=4, held_out=4)
EFFORTS = {effort.name: effort for effort in (QUICK, FULL)}
