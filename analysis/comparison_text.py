"""Put a comparison into sentences."""

from __future__ import annotations

import math
from typing import Any

# How a model's quantity is called when it is larger or smaller than the laboratory's.
WORDS = {"angle of repose": ("steeper", "flatter")}


def verdict_text(numbers: dict[str, Any]) -> str:
    """Return what the comparison says, one paragraph, from the fields of a ComparisonReport."""
    sentences = [_stated(numbers), _judged(numbers)]
    if not numbers["seed_scatter_known"]:
        sentences.append(
            "Only one seed was run and no scatter was given, so u_S counts as 0 and the validation uncertainty is a "
            "lower bound."
        )
    elif math.isfinite(numbers["degrees_of_freedom"]):
        sentences.append(
            f"u_S is the scatter of the mean of {numbers['seeds']} seeds; as few seeds estimate it, 95 % take "
            f"{numbers['coverage_factor']:.2f} u_val (Student) instead of 1.96."
        )
    return " ".join(sentences)


def advice_text(numbers: dict[str, Any]) -> str:
    """Return what to measure or run next."""
    if not numbers["seed_scatter_known"]:
        return "Run at least three seeds before believing the difference."
    if numbers["verdict"] == "model_differs":
        return (
            "More seeds or repeats won't remove the difference. Re-calibrate, and ask which physical effect the model "
            "lacks."
        )
    shares = {
        "the seed scatter": numbers["simulated_uncertainty"],
        "the laboratory": numbers["measured_uncertainty"],
        **{f"{name!r}": value for name, value in numbers["other_uncertainties"].items()},
    }
    largest = max(shares, key=lambda name: shares[name])
    gap = "" if numbers["unit"] == "°" else " "
    cure = {"the seed scatter": "run more seeds", "the laboratory": "repeat the measurement"}
    return (
        f"The largest part of the validation uncertainty is {largest} "
        f"(u = {shares[largest]:.2g}{gap}{numbers['unit']}): "
        f"{cure.get(largest, 'reduce it')} before changing the model."
    )


def _stated(numbers: dict[str, Any]) -> str:
    unit = numbers["unit"]
    gap = "" if unit == "°" else " "
    places = max(0, 1 - math.floor(math.log10(numbers["validation_uncertainty"])))

    def show(value: float) -> str:
        return f"{value:.{places}f}{gap}{unit}".replace("-", "−")

    spread = f"± {show(numbers['simulated_uncertainty'])}" if numbers["seed_scatter_known"] else "(one seed)"
    return (
        f"The model's {numbers['quantity']} {_difference(numbers, places, show(abs(numbers['error'])))}: "
        f"S = {show(numbers['simulated'])} {spread}, "
        f"D = {show(numbers['measured'])} ± {show(numbers['measured_uncertainty'])}, "
        f"E = S − D = {show(numbers['error'])}. That is {numbers['ratio']:.1f} times the validation uncertainty "
        f"u_val = {show(numbers['validation_uncertainty'])}."
    )


def _difference(numbers: dict[str, Any], places: int, shown: str) -> str:
    if round(abs(numbers["error"]), places) == 0:
        return "equals the laboratory's"
    larger, smaller = WORDS.get(numbers["quantity"], ("larger", "smaller"))
    return f"is {shown} {larger if numbers['error'] > 0 else smaller} than the laboratory's"


def _judged(numbers: dict[str, Any]) -> str:
    sources = "seed scatter and the uncertainty of the measurement" + (
        f" (with {', '.join(numbers['other_uncertainties'])})" if numbers["other_uncertainties"] else ""
    )
    if not numbers["seed_scatter_known"] and numbers["verdict"] != "within_uncertainty":
        return "Whether another seed would differ as much isn't known, so the model can't be judged by it."
    if numbers["verdict"] == "within_uncertainty":
        return f"So the difference is explained by {sources}: these data can't show an error of the model."
    if numbers["verdict"] == "model_differs":
        return f"So the difference isn't explained by {sources}: the model is in error by about that much."
    return (
        f"So the difference is more than {sources} would usually give, but not enough to be called an error of the "
        "model."
    )
