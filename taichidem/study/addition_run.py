"""Add an effect to a study: re-calibrate jointly, write the new study, see on fresh seeds whether the error fell."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from taichidem.errors import InputError
from taichidem.study.addition import BELIEVED, RECALIBRATED, WITH_EFFECT, Addition
from taichidem.study.addition_study import rehearse, write_addition
from taichidem.study.campaign import STORE, run_all
from taichidem.study.comparison_rows import comparison_rows
from taichidem.study.comparison_run import Report, opened, writable
from taichidem.study.diagnosis_plan import Plan, plan
from taichidem.study.execution import Run
from taichidem.study.hypothesis import Hypothesis
from taichidem.study.recalibration import FITTING_SEEDS, Estimate, Recalibrated, estimate_runs, recalibrate
from taichidem.study.report import write_standardised_errors, write_waterfall
from taichidem.study.result_file import RESULTS
from taichidem.study.run_counts import counted
from taichidem.study.run_store import RunStore
from taichidem.study.study_file import Study, read_study
from taichidem.study.study_writer import check_new

FRESH_SEEDS = (101, 102, 103, 104)
NO_STRENGTH = 1e-3  # share below which the measurements don't want the effect
LABELS = {BELIEVED: "as believed", RECALIBRATED: "re-calibrated"}


def add(
    study: Study | str | Path,
    effect: str,
    output: str | Path,
    store: RunStore | str | Path | None = None,
    report: Report | None = None,
    *,
    fresh_seeds: Sequence[int] = FRESH_SEEDS,
    effect_rows: int | None = None,
    base_rows: int | None = None,
    executor: Executor | None = None,
) -> Addition:
    """Write a study with an effect more, re-calibrated together with it by simulation, and say what that did to its errors.

    Args:
        study: as `read_study` returns it, or its folder.
        effect: name of the effect to add.
        output: folder of the new study, which must not hold one yet; results go to its folder results.
        store: that keeps the runs, or its file; by default that of the old study, of which the new one gets a copy.
        report: called with the stage and the share done, for a progress bar.
        fresh_seeds: on which the errors are evaluated; nothing is fitted to them.
        effect_rows, base_rows: sizes of the screening design; see `plan`. Those of the diagnosis need no new run.
        executor: workers that simulate, as for `run_all`.

    Returns:
        The addition, written to the new study's results already.

    Raises:
        InputError: before anything is run, an effect that can't be added, a folder that holds a study or can't be written, fresh
            seeds that are fitted to, or what `diagnose` refuses; afterwards, an effect that the measurements don't want, or with
            which a test can't be simulated.
    """
    began = time.perf_counter()
    study = study if isinstance(study, Study) else read_study(study)
    planned = plan(study, [effect], effect_rows=effect_rows, base_rows=base_rows, new_tests=())
    hypothesis = _hypothesis(planned, effect)
    target = check_new(output)
    _check_fresh(planned, fresh_seeds)
    rehearse(planned, hypothesis)
    tell = report or (lambda stage, share: None)
    with opened(study, store) as kept:
        found = recalibrate(planned, hypothesis, kept, tell, executor=executor)
        _check_wanted(effect, found.with_effect)
        steps = _fresh_runs(planned, hypothesis, found, fresh_seeds)
        runs = [run for rows in steps.values() for row in rows for run in row.values()]
        fresh = run_all(runs, kept, lambda share: tell("fresh seeds", share), executor=executor)
        own = kept.path if store is None else None
    rows = _rows_of_steps(planned, steps, fresh)
    _check_simulated(effect, rows[WITH_EFFECT], fresh)
    write_addition(planned, hypothesis, found.with_effect.values, found.with_effect.share, target)
    if own is not None:
        with RunStore(own) as old:
            old.copy_to(target / STORE)
    result = _result(planned, hypothesis, found, rows, target, fresh_seeds)
    result = replace(result, **_counts(found, fresh), wall_s=time.perf_counter() - began)
    result = replace(result, pictures=_pictures(result))
    result.save()
    return result


def _hypothesis(planned: Plan, effect: str) -> Hypothesis:
    if not planned.hypotheses.tested:
        reason = planned.hypotheses.not_tested.get(effect, "the model has it already.")
        raise InputError(f"{effect} can't be added to {planned.study.file}: {reason}")
    return planned.hypotheses.tested[0]


def _check_wanted(effect: str, estimate: Estimate) -> None:
    if abs(estimate.share) < NO_STRENGTH:
        raise InputError(
            f"Re-calibrated together with the parameters, {effect} gets no strength: these measurements don't ask for it. "
            "Nothing was written. `taichidem diagnose` says which effect they ask for, if any."
        )


def _check_fresh(planned: Plan, seeds: Sequence[int]) -> None:
    fitted = sorted(set(seeds) & {*FITTING_SEEDS, *(run.seed for run in planned.runs)})
    if fitted or not seeds:
        raise InputError(
            f"fresh_seeds are {list(seeds)}; give some, none of them fitted to, as {fitted or 'these'} would be."
        )


def _check_simulated(effect: str, rows: pd.DataFrame, fresh: pd.DataFrame) -> None:
    """Refuse an effect with which a test gave nothing: left out of χ², it would look like an error that fell."""
    lost = rows.loc[rows["simulated"].isna(), "experiment"]
    if len(lost):
        failed = fresh[(fresh["experiment"] == lost.iloc[0]) & (fresh["status"] == "failed")]
        raise InputError(
            f"With {effect}, {', '.join(dict.fromkeys(lost))} gave no result on any fresh seed, so that nothing can be "
            f"said of the error. Nothing was written. The reason: {failed['reason'].iloc[-1]}"
        )


def _fresh_runs(
    planned: Plan, hypothesis: Hypothesis, found: Recalibrated, seeds: Sequence[int]
) -> dict[str, list[dict[str, Run]]]:
    """Return the runs of every step on seeds that nothing was fitted to, a dictionary per seed."""
    study = planned.study
    believed = Estimate({c.key: study.believed(c.key) for c in study.calibrate}, 0.0, None)
    ends = {BELIEVED: believed, RECALIBRATED: found.without, WITH_EFFECT: found.with_effect}
    return {step: estimate_runs(planned, hypothesis, end, seeds) for step, end in ends.items()}


def _rows_of_steps(
    planned: Plan, steps: Mapping[str, list[dict[str, Run]]], fresh: pd.DataFrame
) -> dict[str, pd.DataFrame]:
    """Return measured beside simulated for every step."""
    found = {}
    for step, rows in steps.items():
        keys = {run.key for row in rows for run in row.values()}
        table = fresh[fresh["key"].isin(keys)].drop_duplicates(["key", "experiment"])
        found[step] = comparison_rows(planned.study, planned.measurements, table).reset_index(drop=True)
    return found


def _result(
    planned: Plan,
    hypothesis: Hypothesis,
    found: Recalibrated,
    rows: Mapping[str, pd.DataFrame],
    target: Path,
    seeds: Sequence[int],
) -> Addition:
    report = found.with_effect.report
    end = found.with_effect
    strength = hypothesis.strength(end.share, planned.study.at(end.values).model)
    candidate = report.tables["candidates"].to_dict("records")[0] | {"strength": strength}
    parameters = report.tables["parameters_with_best"].to_dict("records")
    errors = report.tables["errors_with_best"]
    waterfall = _waterfall(hypothesis, rows, parameters, errors)
    return Addition(
        study=planned.study.title,
        effect=hypothesis.name,
        title=hypothesis.effect.title,
        parameter=hypothesis.parameter.name,
        unit=hypothesis.parameter.unit,
        strength=strength,
        u_strength=candidate["u_strength"],
        waterfall=waterfall,
        tests=_tests(rows, errors),
        parameters=parameters,
        fresh_seeds=tuple(seeds),
        text=_text(hypothesis, candidate, waterfall),
        runs={},
        failures=(),
        wall_s=0.0,
        new_study=target,
        folder=writable(target / RESULTS),
    )


def _waterfall(
    hypothesis: Hypothesis,
    rows: Mapping[str, pd.DataFrame],
    parameters: Sequence[Mapping[str, Any]],
    errors: pd.DataFrame,
) -> list[dict[str, Any]]:
    """Return χ² and errors of every step, on fresh seeds; predictions of left-out tests are the surrogate's."""
    direct = [p for p in parameters if p["measured"] is not None and np.isfinite(p["measured"])]
    labels = {**LABELS, WITH_EFFECT: f"with {hypothesis.name}"}
    held_out = {RECALIBRATED: errors["held_out_before"], WITH_EFFECT: errors["held_out_after"]}
    steps = []
    for step, table in rows.items():
        off = [(p[step] - p["measured"]) / p["u_measured"] for p in direct]
        z = table["z"].to_numpy(float)
        used = {BELIEVED: 0, RECALIBRATED: len(parameters), WITH_EFFECT: len(parameters) + 1}[step]
        left = held_out.get(step)
        steps.append(
            {
                "step": step,
                "label": labels[step],
                "chi2": float(np.sum(z**2) + np.sum(np.square(off))),
                "dof": int(np.isfinite(z).sum()) + len(direct) - used,
                "rms_fitted": _rms(z),
                "rms_held_out": float("nan") if left is None else _rms(left.to_numpy(float)),
            }
        )
    return steps


def _rms(z: np.ndarray) -> float:
    good = z[np.isfinite(z)]
    return float(np.sqrt(np.mean(good**2))) if len(good) else float("nan")


def _tests(rows: Mapping[str, pd.DataFrame], errors: pd.DataFrame) -> list[dict[str, Any]]:
    """Return a dictionary per measurement, simulated values and errors of every step side by side."""
    first = rows[BELIEVED][["experiment", "observable", "condition", "label", "unit", "measured", "u_measured"]]
    found = first.copy()
    for step, table in rows.items():
        found[step], found[f"z_{step}"] = table["simulated"], table["z"]
    found["u_with_effect"] = rows[WITH_EFFECT]["u_simulated"]
    found["z_held_out_before"] = errors["held_out_before"].to_numpy(float)
    found["z_held_out_after"] = errors["held_out_after"].to_numpy(float)
    return found.to_dict("records")


def _text(hypothesis: Hypothesis, candidate: Mapping[str, Any], waterfall: Sequence[Mapping[str, Any]]) -> str:
    believed, recalibrated, after = waterfall
    unit = "" if candidate["unit"] == "1" else f" {candidate['unit']}"
    return (
        f"{hypothesis.name} was added with {candidate['parameter']} = {candidate['strength']:.3g} ± "
        f"{candidate['u_strength']:.2g}{unit}, re-calibrated together with the other parameters. On seeds that nothing was "
        f"fitted to, χ² is {believed['chi2']:.3g} for the model as believed, {recalibrated['chi2']:.3g} re-calibrated and "
        f"{after['chi2']:.3g} with the effect, on {after['dof']} degrees of freedom. {_predicted(recalibrated, after)}"
    )


def _predicted(before: Mapping[str, Any], after: Mapping[str, Any]) -> str:
    if not np.isfinite([before["rms_held_out"], after["rms_held_out"]]).all():
        return "There are too few tests to leave one out and predict it, so nothing else bears it out."
    return (
        f"Tests that were left out of the fit are predicted with an error of {before['rms_held_out']:.2g} standard "
        f"uncertainties without it and {after['rms_held_out']:.2g} with it."
    )


def _counts(found: Recalibrated, fresh: pd.DataFrame) -> dict[str, Any]:
    every = pd.concat([found.outcomes, fresh], ignore_index=True).drop_duplicates("key")
    failed = every[every["status"] == "failed"]
    return {
        "runs": counted(every),
        "failures": failed[["experiment", "seed", "reason"]].to_dict("records"),
    }


def _pictures(found: Addition) -> dict[str, str]:
    document = found.as_dict()
    written = {
        "waterfall": write_waterfall(document, found.folder),
        "standardised_errors_after": write_standardised_errors(document, found.folder),
    }
    return {name: path.name for name, path in written.items() if path is not None}
