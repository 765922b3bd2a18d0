"""Pluggable analysers of run tables, and heap-image analysis.

Choose an analyser, give it a table::

    report = ResponseSurface(hierarchy="none").analyse(table, responses=["aor_deg"])
    print(report.text())

The analysers are imported when they are asked for, so that a program which needs one of them doesn't wait for all.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from analysis.base import Analyser

#: The built-in analysers by name, as module:class.
BUILT_IN: dict[str, str] = {
    "main_effects": "analysis.main_effects:MainEffects",
    "response_surface": "analysis.response_surface:ResponseSurface",
    "anova": "analysis.anova:Anova",
    "model_summary": "analysis.model_summary:ModelSummary",
    "residuals": "analysis.residuals:Residuals",
    "canonical": "analysis.canonical:Canonical",
    "optimise": "analysis.optimise:Optimise",
    "property_statistics": "analysis.property_statistics:PropertyStatistics",
    "bulk_density": "analysis.bulk_density:BulkDensity",
    "missing_effect": "analysis.missing_effect.analyser:MissingEffect",
    "standardised_errors": "analysis.standardised_errors:StandardisedErrors",
}

_EXPORTS = {target.partition(":")[2]: target for target in BUILT_IN.values()} | {
    "Analyser": "analysis.base:Analyser",
    "AnalysisError": "analysis.errors:AnalysisError",
    "Goal": "analysis.desirability:Goal",
    "Report": "analysis.report:Report",
}

__all__ = ["BUILT_IN", "load", *sorted(_EXPORTS)]


def load(name: str) -> type[Analyser]:
    """Return a built-in analyser class by its name (``BUILT_IN`` lists them)."""
    return _imported(BUILT_IN[name])


def __getattr__(name: str) -> Any:
    if name in _EXPORTS:
        return _imported(_EXPORTS[name])
    raise AttributeError(f"module 'analysis' has no attribute {name!r}")


def _imported(target: str) -> Any:
    module, _, attribute = target.partition(":")
    return getattr(importlib.import_module(module), attribute)
