"""The paper's flow chart from its first table to its last, with this engine; and the result as one file."""

from __future__ import annotations

import time
from collections.abc import Mapping
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

from taichidem.errors import InputError, unknown_name
from taichidem.graphics import require_graphics
from taichidem.heap_comparison import LABORATORY, writable_folder
from taichidem.paper import held_out
from taichidem.paper.checks import Check, checks_of
from taichidem.paper.effort import EFFORTS
from taichidem.paper.heaps import coarse_heap, fine_heap
from taichidem.paper.kept_heaps import KeptHeaps, pour_and_keep
from taichidem.paper.next_factor import search_further
from taichidem.paper.optimum import Optimum, confirm, search
from taichidem.paper.screening import Screening, screen
from taichidem.paper.session import Session, Tell
from taichidem.paper.setting_up import conditions
from taichidem.paper.surface import Surface, fit_surface
from taichidem.study import Comparison, RunStore
from taichidem.study.campaign import STORE
from taichidem.study.result_file import ResultFile, plain
from taichidem.whole_file import write_whole

FINE_FIRST_SEED = 6000
NOTHING: Tell = lambda stage, share: None  # noqa: E731


@dataclass(frozen=True)
class Reproduction(ResultFile):
    """Everything that a reproduction found.

    Attributes:
        effort: quick or full.
        screening, surface: the two designs.
        rounds: of the search for the optimum; the last is the confirmation, with heaps that had no part in the search.
        fine: heaps of 3 mm at the optimum.
        held_out: the coarse model beside fine grains in tests it was not fitted to.
        checks: the paper's numbers beside ours.
        folder: where everything was written.
        wall_s: time it took, runs found in the store not counted [s].
    """

    file: ClassVar[str] = "paper.json"

    effort: str
    screening: Screening
    surface: Surface
    rounds: tuple[Optimum, ...]
    fine: KeptHeaps
    held_out: Comparison
    checks: tuple[Check, ...]
    folder: Path
    wall_s: float

    @property
    def optimum(self) -> Optimum:
        """The setting that was confirmed."""
        return self.rounds[-1]

    def as_dict(self) -> dict[str, Any]:
        """Return the numbers in plain types."""
        return plain(
            {
                "schema": self.schema,
                "effort": self.effort,
                "laboratory_deg": LABORATORY,
                "screening": {name: _rows(getattr(self.screening, name)) for name in ("effects", "runs", "heaps")},
                "surface": {
                    "points": _rows(self.surface.points),
                    "heaps": _rows(self.surface.heaps),
                    "rms_deg": self.surface.rms,
                    "rank_correlation": self.surface.rank_correlation,
                    "numbers": dict(self.surface.report.numbers),
                    "coefficients": _rows(self.surface.report.tables["uncoded_coefficients"]),
                    "anova": _rows(self.surface.report.tables["anova"]),
                },
                "optimum": [
                    {
                        "levels": dict(r.levels),
                        "predicted_deg": r.predicted,
                        "how": r.how,
                        "raised": r.raised,
                        "confirmation": r.confirmation,
                        "hits": r.hits,
                        "heaps": r.heaps.as_dict(),
                    }
                    for r in self.rounds
                ],
                "fine": self.fine.as_dict(),
                "held_out": self.held_out.as_dict(),
                "checks": [vars(check) for check in self.checks],
                "wall_s": self.wall_s,
                "conditions": conditions(self),
            }
        )


def _rows(table: Any) -> list[Mapping[str, Any]]:
    return table.to_dict("records")


def reproduce(
    output: str | Path, effort: str = "quick", tell: Tell | None = None, *, executor: Executor | None = None
) -> Reproduction:
    """Run the paper's study and what follows from it into a folder; what is there already is not run again.

    Designs and settings are the paper's (Tables 2 to 5), the engine, the statistics and the measurement in pictures are ours.

    Args:
        output: folder for the runs, tables, pictures and the report.
        effort: "quick" with a softened Young's modulus, or "full" with the real one.
        tell: called with the stage and the share done, for a progress bar.
        executor: workers that simulate, as for `run_all`; heaps whose time is taken are poured in this process all the same.

    Raises:
        InputError: an unknown effort, or a folder that can't be written.
        EnvironmentProblem: nothing can be drawn on this machine.
        SimulationError: too many heaps failed.
    """
    from taichidem.paper.page import write_page

    if effort not in EFFORTS:
        raise unknown_name("effort", effort, EFFORTS)
    folder = writable_folder(output)
    _check_effort(folder, effort)
    require_graphics()  # better now than after minutes of pouring
    began = time.perf_counter()
    with RunStore(folder / STORE) as store:
        session = Session(folder, store, EFFORTS[effort], tell or NOTHING, executor)
        screening, surface = screen(session), fit_surface(session)
        rounds = find_setting(session, screening, surface)
        levels = rounds[-1].levels
        seeds = range(FINE_FIRST_SEED + 1, FINE_FIRST_SEED + 1 + session.effort.fine)
        fine = pour_and_keep(session, "fine_heaps", fine_heap(), session.model(levels), seeds)
        compared = held_out.confirm(session, levels)
    checks = tuple(checks_of(screening, surface, rounds, fine))
    wall = time.perf_counter() - began
    result = Reproduction(effort, screening, surface, tuple(rounds), fine, compared, checks, folder, wall)
    result.save()
    write_page(result)
    return result


def find_setting(session: Session, screening: Screening, surface: Surface) -> list[Optimum]:
    """Return the rounds of the search for the laboratory's angle, over the surface and, where that isn't enough, beyond it.

    The last is a confirmation: its heaps had no part in the search.
    """
    rounds = search(session, surface)
    if rounds[-1].settled:
        rounds.append(confirm(session, rounds[-1], coarse_heap(), 1, "The setting that was found"))
    if not rounds[-1].settled:
        rounds += search_further(session, screening, rounds[-1])
    return rounds


def _check_effort(folder: Path, effort: str) -> None:
    """Refuse a folder that holds the other effort's results, which would be overwritten."""
    marker = folder / "effort"
    if marker.is_file() and (held := marker.read_text(encoding="utf-8").strip()) != effort:
        raise InputError(f"{folder} holds a {held} reproduction; give another folder with -o for the {effort} one.")
    write_whole(marker, effort + "\n")
