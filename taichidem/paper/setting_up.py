"""How the heaps were poured and measured, and by what: angles mean little without."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from taichidem import __version__, runtime
from taichidem.experiments import FixedFunnel
from taichidem.heap_views import AZIMUTHS
from taichidem.paper.effort import EFFORTS
from taichidem.paper.heaps import coarse_heap, fine_heap, model_at, similar_heap
from taichidem.physics_version import PHYSICS_VERSION

if TYPE_CHECKING:
    from taichidem.paper.optimum import Optimum
    from taichidem.paper.reproduction import Reproduction

COARSE, FINE, FURTHER = "6 mm", "3 mm", "6 mm, twice the fall"


def conditions(result: Reproduction) -> dict[str, Any]:
    """Return the settings of each kind of heap in SI, fit window, effort, stiffness, version, physics version and processor."""
    running = runtime.in_use()
    return {
        "heaps": {name: heap.settings.model_dump() for name, heap in heaps(result.rounds).items()},
        "measured": window_text(),
        "effort": asdict(EFFORTS[result.effort]),
        "youngs_modulus_Pa": model_at({}, stiffness=EFFORTS[result.effort].stiffness).materials[0].youngs_modulus,
        "version": __version__,
        "physics": PHYSICS_VERSION,
        "arch": running.arch,
        "threads": running.threads,
    }


def heaps(rounds: Sequence[Optimum]) -> dict[str, FixedFunnel]:
    """Return kind of heap → how it was poured."""
    found = {COARSE: coarse_heap(), FINE: fine_heap()}
    if any(each.raised for each in rounds):
        found[FURTHER] = similar_heap()
    return found


def window_text() -> str:
    """Return over what an angle is measured: a wider window gives another angle, by several degrees."""
    s = coarse_heap().settings
    return (
        f"straight line over {s.fit_from:.2f}–{s.fit_to:.2f} of the cup radius in pictures from {len(AZIMUTHS)} sides"
    )


def settings_rows(rounds: Sequence[Optimum]) -> list[dict[str, Any]]:
    """Return a row per setting that was given a value: name, its values by kind of heap, unit, meaning."""
    poured = heaps(rounds)
    rows = []
    for name, field in FixedFunnel.settings_type.model_fields.items():
        values = [getattr(heap.settings, name) for heap in poured.values()]
        if any(value not in ("", None) for value in values):
            unit = (field.json_schema_extra or {})["unit"]  # type: ignore[index]
            rows.append({"name": name, "values": values, "unit": unit, "meaning": field.description})
    return rows
