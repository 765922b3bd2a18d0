"""From result files to what the pictures show: steps of the waterfall, errors per test, the matrix of look-alikes."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from taichidem.study.report.result_schema import complete
from taichidem.study.report.wording import spoken

STEPS = ("believed", "recalibrated", "with_effect")
STEP_NAMES = {"believed": "as believed", "recalibrated": "re-calibrated", "with_effect": "with the effect"}


@dataclass(frozen=True)
class WaterfallStep:
    """One state of the model.

    Attributes:
        step: believed, recalibrated or with_effect.
        label: for people.
        chi2, dof: χ² and its degrees of freedom; the latter None where unknown.
        fitted: RMS error of the tests that were fitted, in standard uncertainties; None where unknown.
        held_out: the same of tests predicted without having been fitted.
    """

    step: str
    label: str
    chi2: float
    dof: float | None
    fitted: float | None
    held_out: float | None


@dataclass(frozen=True)
class TestErrors:
    """The errors of one test in standard uncertainties, signed, by step; those that are unknown are left out."""

    __test__ = False  # not a test of ours, whatever a collector makes of the name
    label: str
    by_step: Mapping[str, float]


@dataclass(frozen=True)
class LookAlikes:
    """The matrix of cosines ρ between the signatures of effects, what re-calibration can imitate taken out.

    Attributes:
        effects: names, best first.
        titles: for people, in the same order.
        rho: rows of numbers in [−1, 1], None where unknown; the diagonal is 1.
    """

    effects: tuple[str, ...]
    titles: tuple[str, ...]
    rho: tuple[tuple[float | None, ...], ...]


def kind_of(document: Mapping[str, Any]) -> str:
    """Return whether a result is an addition, a verdict or a comparison."""
    return "addition" if "waterfall" in document else "verdict" if "verdict" in document else "comparison"


def waterfall_steps(document: Mapping[str, Any]) -> list[WaterfallStep]:
    """Return the states of the model in order (believed, re-calibrated, with the effect) whose χ² is known.

    Args:
        document: content of verdict.json or of addition.json. With the latter all numbers were simulated on fresh seeds.
    """
    kind = kind_of(document)
    result = complete(kind, document)
    steps = _steps_of_addition(result) if kind == "addition" else _steps_of_verdict(result)
    return [step for step in steps if step.chi2 is not None]


def _steps_of_addition(addition: Mapping[str, Any]) -> list[WaterfallStep]:
    return [
        WaterfallStep(
            s["step"], s["label"] or spoken(s["step"]), s["chi2"], s["dof"], s["rms_fitted"], s["rms_held_out"]
        )
        for s in addition["waterfall"]
    ]


def _steps_of_verdict(verdict: Mapping[str, Any]) -> list[WaterfallStep]:
    chi2, held_out = verdict["chi2"], verdict["held_out_error"]
    rows = verdict["standardised_errors"]
    measured = [p for p in verdict["parameters"] if p["measured"] is not None]
    dof = {
        "believed": len(rows) + len(measured) if rows else None,  # nothing is fitted yet
        "recalibrated": chi2["dof"],
        "with_effect": chi2["dof_with_effect"],
    }
    out = {"believed": None, "recalibrated": held_out["before"], "with_effect": held_out["after"]}
    labels = {"believed": "As believed", "recalibrated": "Re-calibrated", "with_effect": f"+ {_best(verdict)}"}
    return [
        WaterfallStep(step, labels[step], chi2[step], dof[step], rms([row[step] for row in rows]), out[step])
        for step in STEPS
    ]


def _best(verdict: Mapping[str, Any]) -> str:
    titles = effect_titles(verdict)
    best = verdict["effects"][0] if verdict["effects"] else next(iter(titles), "the best effect")
    return titles.get(best, spoken(best))


def effect_titles(verdict: Mapping[str, Any]) -> dict[str, str]:
    """Return the titles of the candidate effects by name, best first."""
    return {row["effect"]: row["title"] or spoken(row["effect"]) for row in verdict["table"]}


def rms(values: list[float | None]) -> float | None:
    """Return the root mean square of the numbers that are known."""
    known = [v for v in values if v is not None]
    return math.sqrt(sum(v * v for v in known) / len(known)) if known else None


def test_errors(document: Mapping[str, Any]) -> list[TestErrors]:
    """Return the standardised errors per test, in the document's order.

    Args:
        document: content of comparison.json, verdict.json or addition.json.
    """
    kind = kind_of(document)
    result = complete(kind, document)
    if kind == "comparison":
        return [TestErrors(label_of(row), _known({"believed": row["z"]})) for row in result["rows"]]
    if kind == "addition":
        return [TestErrors(label_of(r), _known({s: r[f"z_{s}"] for s in STEPS})) for r in result["tests"]]
    return [TestErrors(label_of(r), _known({s: r[s] for s in STEPS})) for r in result["standardised_errors"]]


test_errors.__test__ = False  # type: ignore[attr-defined]


def _known(errors: Mapping[str, float | None]) -> dict[str, float]:
    return {step: z for step, z in errors.items() if z is not None}


def label_of(row: Mapping[str, Any]) -> str:
    """Return the name of a measured observable: its label, or made of test, observable and condition."""
    parts = (row["experiment"], spoken(row["observable"]), row["condition"])
    return row["label"] or ", ".join(part for part in parts if part)


def look_alikes(verdict: Mapping[str, Any]) -> LookAlikes:
    """Return the matrix of ρ over the candidate effects of verdict.json; ρ is taken from either of a pair's two rows."""
    result = complete("verdict", verdict)
    titles = effect_titles(result)
    rho = {row["effect"]: row["rho"] for row in result["table"]}

    def cosine(a: str, b: str) -> float | None:
        if a == b:
            return 1.0
        forward = rho[a].get(b)
        return rho[b].get(a) if forward is None else forward

    names = tuple(titles)
    return LookAlikes(names, tuple(titles.values()), tuple(tuple(cosine(a, b) for b in names) for a in names))
