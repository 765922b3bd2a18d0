"""The verdict in one plain sentence, and the few numbers that stand beside it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from taichidem.study.report.results_folder import Results
from taichidem.study.report.series import WaterfallStep, effect_titles, rms, waterfall_steps
from taichidem.study.report.wording import listed, number, plus_minus, probability, size, spoken, with_unit

BADGES = {
    "nothing_missing": "Nothing missing",
    "effect": "An effect is missing",
    "one_of": "One of several effects is missing",
    "something_else": "Something else is missing",
    "cannot_tell": "Can't tell",
    "added": "Effect added",
    "compared": "Compared, not yet diagnosed",
    "searched": "Search for missing effects",
}
ARROW = " → "
UNITS = "standard uncertainties"


@dataclass(frozen=True)
class Headline:
    """What stands on top of the page.

    Attributes:
        kind: one of the keys of BADGES, also the name of its colour.
        badge: two or three words.
        sentence: the verdict with strength ± u and the error before → after.
        figures: (what, numbers) for the tiles below it.
        next: what to measure next, or nothing.
    """

    kind: str
    badge: str
    sentence: str
    figures: tuple[tuple[str, str], ...]
    next: str = ""


def headline(results: Results) -> Headline:
    """Return the headline of a study: of its verdict, else of what was added, else of the comparison."""
    verdict, addition, comparison = (results.get(kind) for kind in ("verdict", "addition", "comparison"))
    if verdict is not None:
        sentence = _SENTENCES[verdict["verdict"]](verdict)
        if addition is not None:
            sentence = f"{_added(addition)} {sentence}"
        upcoming = verdict["next_measurement"] or {"text": ""}
        return _made(verdict["verdict"], sentence, _figures(verdict), upcoming["text"])
    if addition is not None:
        return _made("added", _added(addition), _figures(addition))
    if comparison is not None:
        return _made("compared", _compared(comparison), _chi2_of(comparison))
    discovery = results.documents["discovery"]
    return _made("searched", discovery["text"] or f"The search stopped because {discovery['stopped_because']}.", ())


def _made(kind: str, sentence: str, figures: tuple[tuple[str, str], ...], upcoming: str = "") -> Headline:
    return Headline(kind, BADGES[kind], sentence, figures, upcoming)


def _nothing_missing(verdict: Mapping[str, Any]) -> str:
    before, after = (rms([row[s] for row in verdict["standardised_errors"]]) for s in ("believed", "recalibrated"))
    fall = "" if before is None or after is None else f" (error {size(before)}{ARROW}{size(after)} {UNITS})"
    limits = any(row["detection_limit"] is not None for row in verdict["table"])
    hint = " How strong an effect would have to be to show is told with each effect below." if limits else ""
    return f"Re-calibrated within its ranges, the model agrees with the measurements{fall}: nothing is missing.{hint}"


def _effect(verdict: Mapping[str, Any]) -> str:
    return f"The model lacks {_named(verdict, 0)}. {_gain(verdict, 'Adding it')}"


def _one_of(verdict: Mapping[str, Any]) -> str:
    names = [_named(verdict, i) for i in range(len(verdict["effects"]))]
    told = listed(names, "or") or "several effects"
    return f"The model lacks one of these, and the measurements can't say which: {told}. {_gain(verdict, 'Adding the first')}"


def _something_else(verdict: Mapping[str, Any]) -> str:
    best = f", not even {_named(verdict, 0)}" if verdict["effects"] else ""
    after = verdict["chi2"]["p_with_effect"]
    still = f" With it the tests still fail (p {_p(after)})." if best and after is not None else ""
    return f"Something is missing that no effect in the library explains{best}.{still} {_gain(verdict, 'The best addition')}"


def _cannot_tell(verdict: Mapping[str, Any]) -> str:
    return "These measurements can't tell whether an effect is missing, nor which."


_SENTENCES = {
    "nothing_missing": _nothing_missing,
    "effect": _effect,
    "one_of": _one_of,
    "something_else": _something_else,
    "cannot_tell": _cannot_tell,
}


def _named(verdict: Mapping[str, Any], i: int) -> str:
    """Return an effect of the verdict with its strength."""
    name = verdict["effects"][i]
    row = next((row for row in verdict["table"] if row["effect"] == name), None)
    title = effect_titles(verdict).get(name, spoken(name))
    return f"{_lower(title)}{_strength(row)}" if row else _lower(title)


def _strength(row: Mapping[str, Any]) -> str:
    if row["strength"] is None:
        return ""
    name = spoken(row["parameter"]) or "strength"
    return f" ({name} {with_unit(plus_minus(row['strength'], row['u_strength']), row['unit'])})"


def _gain(document: Mapping[str, Any], subject: str) -> str:
    """Say how an error falls: of held-out tests where known, else of the fitted ones, else χ²."""
    before, after = _before_after(waterfall_steps(document))
    if before is None or after is None:
        return ""
    if before.held_out is not None and after.held_out is not None:
        what, numbers, of = (
            "error of tests held out from the fit",
            (size(before.held_out), size(after.held_out)),
            f" {UNITS}",
        )
    elif before.fitted is not None and after.fitted is not None:
        what, numbers, of = "error", (size(before.fitted), size(after.fitted)), f" {UNITS}"
    else:
        what, numbers, of = "misfit χ²", (number(before.chi2, 3), number(after.chi2, 3)), ""
    return f"{subject} brings the {what} from {numbers[0]} to {numbers[1]}{of}."


def _before_after(steps: list[WaterfallStep]) -> tuple[WaterfallStep | None, WaterfallStep | None]:
    by_step = {step.step: step for step in steps}
    return by_step.get("recalibrated"), by_step.get("with_effect")


def _added(addition: Mapping[str, Any]) -> str:
    title = addition["title"] or spoken(addition["effect"])
    return f"{title} was added{_strength(addition)}. {_gain(addition, 'This')}"


def _compared(comparison: Mapping[str, Any]) -> str:
    tests, failing = len(comparison["rows"]), len(comparison["failing"])
    if not failing:
        agree = f"All {tests} measured observables agree with the model within their uncertainties"
    else:
        verb = "lies" if failing == 1 else "lie"
        agree = f"{failing} of {tests} measured observables {verb} beyond what the uncertainties explain"
    p = comparison["p_value"]
    return f"{agree}{'' if p is None else f' (p {_p(p)} for all together)'}."


def _p(p: float) -> str:
    text = probability(p)
    return text if text.startswith("<") else f"= {text}"


def _figures(document: Mapping[str, Any]) -> tuple[tuple[str, str], ...]:
    steps = waterfall_steps(document)
    ratios = [number(s.chi2 / s.dof, 3) for s in steps if s.dof]
    figures = [("χ² per degree of freedom", ARROW.join(ratios))] if ratios else []
    held_out = [size(s.held_out) for s in steps if s.held_out is not None]
    if held_out:
        figures.append((f"error of held-out tests, {UNITS}", ARROW.join(held_out)))
    row = document if "strength" in document else _first(document)
    if row and row["strength"] is not None:
        what = spoken(row["parameter"]) or "strength"
        figures.append((what, with_unit(plus_minus(row["strength"], row["u_strength"]), row["unit"])))
    return tuple(figures)


def _first(verdict: Mapping[str, Any]) -> Mapping[str, Any] | None:
    best = verdict["effects"][:1]
    return next((row for row in verdict["table"] if [row["effect"]] == best), None)


def _chi2_of(comparison: Mapping[str, Any]) -> tuple[tuple[str, str], ...]:
    if comparison["chi2"] is None or not comparison["dof"]:
        return ()
    ratio = number(comparison["chi2"] / comparison["dof"], 3)
    return (
        ("χ² per degree of freedom", ratio),
        ("failing", f"{len(comparison['failing'])} of {len(comparison['rows'])}"),
    )


def _lower(title: str) -> str:
    """Return a title for the middle of a sentence; abbreviations such as JKR keep their capitals."""
    return title[:1].lower() + title[1:] if title[1:2].islower() else title
