"""What the result files of a study hold, as far as pictures and pages need it; whatever is missing becomes None or empty."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict

Verdict5 = Literal["nothing_missing", "effect", "one_of", "something_else", "cannot_tell"]


def _finite(value: Any) -> Any:
    """Turn NaN and infinities, which JSON doesn't know but Python writes, into missing numbers."""
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _text(value: Any) -> Any:
    return "" if value is None else value


def _or_empty(kind: type) -> BeforeValidator:
    return BeforeValidator(lambda value: kind() if value is None else value)


Number = Annotated[float | None, BeforeValidator(_finite)]
Text = Annotated[str, BeforeValidator(_text)]
Texts = Annotated[list[str], _or_empty(list)]
Numbers = Annotated[list[Number], _or_empty(list)]
Flag = Annotated[bool, BeforeValidator(bool)]
Side = Annotated[Literal["", "low", "high"], BeforeValidator(_text)]


class _Part(BaseModel):
    model_config = ConfigDict(extra="ignore", coerce_numbers_to_str=True, protected_namespaces=())


class Runs(_Part):
    stored: int | None = None
    new: int | None = None
    failed: int | None = None


class Failure(_Part):
    experiment: Text = ""
    seed: int | str | None = None
    reason: Text = ""


class _Test(_Part):
    experiment: Text = ""
    observable: Text = ""
    condition: Text = ""
    label: Text = ""
    unit: Text = ""
    measured: Number = None
    u_measured: Number = None


class ComparisonRow(_Test):
    n_measured: Number = None
    simulated: Number = None
    u_simulated: Number = None
    n_seeds: Number = None
    error: Number = None
    u_val: Number = None
    z: Number = None
    p: Number = None
    fails: Flag = False


class ComparedParameter(_Part):
    key: Text = ""
    unit: Text = ""
    believed: Number = None
    measured: Number = None
    u_measured: Number = None
    z: Number = None


class Trend(_Part):
    observable: Text = ""
    condition: Text = ""
    slope: Number = None
    u_slope: Number = None
    p: Number = None
    text: Text = ""


class _Result(_Part):
    study: Text = ""
    text: Text = ""
    runs: Annotated[Runs, _or_empty(Runs)] = Runs()
    failures: Annotated[list[Failure], _or_empty(list)] = []
    wall_s: Number = None
    pictures: Annotated[dict[str, str], _or_empty(dict)] = {}


class Comparison(_Result):
    """comparison.json"""

    rows: Annotated[list[ComparisonRow], _or_empty(list)] = []
    parameters: Annotated[list[ComparedParameter], _or_empty(list)] = []
    chi2: Number = None
    dof: Number = None
    p_value: Number = None
    failing: Texts = []
    trends: Annotated[list[Trend], _or_empty(list)] = []
    advice: Texts = []


class ChiSquared(_Part):
    believed: Number = None
    recalibrated: Number = None
    with_effect: Number = None
    dof: Number = None
    dof_with_effect: Number = None
    p_recalibrated: Number = None
    p_with_effect: Number = None


class HeldOut(_Part):
    before: Number = None
    after: Number = None


class Candidate(_Part):
    effect: str
    title: Text = ""
    parameter: Text = ""
    unit: Text = ""
    strength: Number = None
    u_strength: Number = None
    strongest_probed: Number = None
    chi2_drop: Number = None
    chi2: Number = None
    score: Number = None
    adjusted_p: Number = None
    eta: Number = None
    rho: Annotated[dict[str, Number], _or_empty(dict)] = {}
    held_out_error: Number = None
    aicc: Number = None
    detection_limit: Number = None
    at_bound: Texts = []
    beyond_probed: Flag = False
    in_class: Flag = False
    visible_as: Text = ""
    note: Text = ""


class NotTested(_Part):
    effect: Text = ""
    reason: Text = ""


class Parameter(_Part):
    key: Text = ""
    unit: Text = ""
    low: Number = None
    high: Number = None
    believed: Number = None
    measured: Number = None
    u_measured: Number = None
    recalibrated: Number = None
    u_recalibrated: Number = None
    with_effect: Number = None
    u_with_effect: Number = None
    at_bound: Side = ""
    at_bound_with_effect: Side = ""


class StandardisedError(_Test):
    believed: Number = None
    recalibrated: Number = None
    with_effect: Number = None
    held_out_before: Number = None
    held_out_after: Number = None


class NextMeasurement(_Part):
    text: Text = ""
    what: Text = ""
    experiment: Text = ""
    settings: Annotated[dict[str, Any], _or_empty(dict)] = {}
    observable: Text = ""
    unit: Text = ""
    u_assumed: Number = None
    separates: Texts = []
    separation: Number = None
    predictions: Annotated[dict[str, Number], _or_empty(dict)] = {}


class Diagnosis(_Result):
    """verdict.json"""

    verdict: Verdict5
    advice: Texts = []
    effects: Texts = []
    chi2: Annotated[ChiSquared, _or_empty(ChiSquared)] = ChiSquared()
    held_out_error: Annotated[HeldOut, _or_empty(HeldOut)] = HeldOut()
    table: Annotated[list[Candidate], _or_empty(list)] = []
    not_tested: Annotated[list[NotTested], _or_empty(list)] = []
    parameters: Annotated[list[Parameter], _or_empty(list)] = []
    standardised_errors: Annotated[list[StandardisedError], _or_empty(list)] = []
    next_measurement: NextMeasurement | None = None
    threshold: Number = None
    bootstrap: Number = None
    design: Annotated[dict[str, Any], _or_empty(dict)] = {}
    assumptions: Texts = []


class Step(_Part):
    step: Text = ""
    label: Text = ""
    chi2: Number = None
    dof: Number = None
    rms_fitted: Number = None
    rms_held_out: Number = None


class AddedTest(_Test):
    believed: Number = None
    recalibrated: Number = None
    with_effect: Number = None
    u_with_effect: Number = None
    z_believed: Number = None
    z_recalibrated: Number = None
    z_with_effect: Number = None
    z_held_out_before: Number = None
    z_held_out_after: Number = None


class Addition(_Result):
    """addition.json"""

    effect: str
    title: Text = ""
    parameter: Text = ""
    unit: Text = ""
    strength: Number = None
    u_strength: Number = None
    waterfall: Annotated[list[Step], _or_empty(list)] = []
    tests: Annotated[list[AddedTest], _or_empty(list)] = []
    parameters: Annotated[list[Parameter], _or_empty(list)] = []
    fresh_seeds: Annotated[list[int | str], _or_empty(list)] = []


class DiscoveryStep(_Part):
    verdict: Text = ""
    effects: Texts = []
    added: Text = ""
    chi2: Number = None
    dof: Number = None
    folder: Text = ""


class Discovery(_Result):
    """discovery.json"""

    steps: Annotated[list[DiscoveryStep], _or_empty(list)] = []
    removed: Texts = []
    stopped_because: Text = ""


KINDS: Mapping[str, type[_Part]] = {
    "comparison": Comparison,
    "verdict": Diagnosis,
    "addition": Addition,
    "discovery": Discovery,
}


def complete(kind: str, document: Mapping[str, Any]) -> dict[str, Any]:
    """Return a result with every key that a page or a picture reads, those that are missing as None or empty.

    Args:
        kind: comparison, verdict, addition or discovery.
        document: as read from the file of that name, or as about to be written to it.

    Raises:
        pydantic.ValidationError: a value of another type than the file's format says.
    """
    return KINDS[kind].model_validate(document).model_dump()
