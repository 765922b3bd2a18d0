"""Find out which effect a study's model lacks: plan, run, analyse, write."""

from __future__ import annotations

import time
from collections.abc import Iterable, Sequence
from concurrent.futures import Executor
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import pandas as pd

from taichidem import plugins
from taichidem.errors import InputError, TaichidemError
from taichidem.study.campaign import run_all
from taichidem.study.comparison_rows import comparison_rows, measured_parameters
from taichidem.study.comparison_run import SEEDS, Report, opened, writable
from taichidem.study.diagnosis import Diagnosis
from taichidem.study.diagnosis_plan import Plan, plan
from taichidem.study.hypothesis import Hypothesis
from taichidem.study.report import write_look_alikes, write_standardised_errors, write_waterfall
from taichidem.study.result_file import RESULTS
from taichidem.study.run_counts import counted
from taichidem.study.run_store import RunStore
from taichidem.study.setting_key import SettingKey
from taichidem.study.study_file import Study, read_study

ANALYSER = "missing_effect"
ASSUMPTIONS = (
    "The scatter from seed to seed is the same all over the design and independent between tests.",
    "Stated uncertainties u are standard uncertainties of independent errors; what tests share is not counted.",
    "No term for the time step or for softened stiffness is counted.",
    "A surrogate stands for the simulator between the simulated points; what it leaves uncertain is counted in every χ².",
    "Effects were simulated one at a time; where two are named together, what they do is added.",
)


def diagnose(
    study: Study | str | Path,
    effects: Iterable[str] | None = None,
    seeds: Sequence[int] = SEEDS,
    store: RunStore | str | Path | None = None,
    output: str | Path | None = None,
    report: Report | None = None,
    *,
    effect_rows: int | None = None,
    base_rows: int | None = None,
    new_tests: Iterable[str] | None = None,
    retry_failed: bool = False,
    executor: Executor | None = None,
) -> Diagnosis:
    """Re-calibrate a study's model, put every effect that it lacks on trial, and come to one verdict of five.

    Args:
        study: as `read_study` returns it, or its folder.
        effects: names of those to test; every registered one by default.
        seeds: of the model as it stands.
        store: that keeps the runs, or its file; by default runs.sqlite in the study's folder.
        output: folder for verdict.json and pictures; by default results in the study's folder.
        report: called with the stage and the share done, for a progress bar.
        effect_rows, base_rows, new_tests: what is simulated; see `plan`.
        retry_failed: run those again that failed before.
        executor: workers that simulate, as for `run_all`.

    Returns:
        The diagnosis, written to the folder already.

    Raises:
        InputError: what is wrong with study, measurements, folder or store, before anything is run; or every run of a test
            failed.
    """
    began = time.perf_counter()
    study = study if isinstance(study, Study) else read_study(study)
    planned = plan(study, effects, seeds, effect_rows, base_rows, new_tests)
    folder = writable(study.path / RESULTS if output is None else output)
    tell = report or (lambda stage, share: None)
    tell("simulating", 0.0)
    with opened(study, store) as runs:
        told = partial(tell, "simulating")
        outcomes = run_all(planned.runs, runs, told, retry_failed=retry_failed, executor=executor)
    tell("analysing", 0.0)
    found = evaluate(planned, outcomes, folder)
    found = replace(found, wall_s=time.perf_counter() - began)
    found = replace(found, pictures=_pictures(found))
    found.save()
    tell("analysing", 1.0)
    return found


def evaluate(planned: Plan, outcomes: pd.DataFrame, folder: Path) -> Diagnosis:
    """Return the diagnosis from what the runs gave; nothing is written.

    Raises:
        InputError: the runs give too little to tell.
    """
    study, measured = planned.study, planned.measurements
    believed = outcomes[outcomes["key"].isin({run.key for run in planned.believed})]
    believed = believed.drop_duplicates(["key", "experiment"])  # equal tests under two names are one run
    rows = comparison_rows(study, measured, believed)
    analysed = analyse(planned, planned.table(outcomes))
    numbers = analysed.numbers
    direct = measured_parameters(study)
    chi2 = {
        "believed": float((rows["z"] ** 2).sum(skipna=False) + (direct["z"] ** 2).sum()),
        "recalibrated": numbers["chi2_recalibrated"],
        "with_effect": numbers["chi2_with_effect"],
        "dof": numbers["dof"],
        "dof_with_effect": numbers["dof_with_effect"],
        "p_recalibrated": numbers["p_recalibrated"],
        "p_with_effect": numbers["p_with_effect"],
    }
    each = outcomes.drop_duplicates("key")
    return Diagnosis(
        study=study.title,
        verdict=analysed.details["verdict"],
        effects=tuple(analysed.details["effects"]),
        text=" ".join([*_as_believed(chi2["believed"]), *analysed.sentences]),
        advice=tuple(analysed.advice),
        chi2=chi2,
        held_out_error={"before": numbers["held_out_before"], "after": numbers["held_out_after"]},
        table=_candidates(planned, analysed),
        not_tested=[
            {"effect": name, "reason": reason}
            for name, reason in {**planned.hypotheses.not_tested, **analysed.details["not_tested"]}.items()
        ],
        parameters=analysed.tables["parameters"].to_dict("records"),
        standardised_errors=_errors(rows, analysed.tables["errors"]),
        next_measurement=_next_measurement(planned, analysed),
        threshold=numbers["threshold"],
        bootstrap=analysed.details["draws"],
        design=_design(planned, analysed),
        runs=counted(each),
        failures=each.loc[each["status"] == "failed", ["experiment", "seed", "reason"]].to_dict("records"),
        assumptions=ASSUMPTIONS,
        wall_s=0.0,
        folder=folder,
    )


def analyse(planned: Plan, table: pd.DataFrame) -> Any:
    """Return the report of the registered analyser."""
    study, measured = planned.study, planned.measurements
    parameters = pd.DataFrame(
        [
            {
                **{name: getattr(entry, name) for name in ("key", "low", "high", "value", "u", "unit")},
                "believed": study.believed(entry.key),
                "test": entry.names.experiment if isinstance(entry.names, SettingKey) else "",
            }
            for entry in study.calibrate
        ]
    )
    uncertainties = {
        f"{name}.{observable}": u for name, p in planned.proposals.items() for observable, u in p.uncertainties.items()
    }
    analyser = plugins.get("analyser", ANALYSER)(
        parameters=parameters,
        measurements=measured.rename(columns={"experiment": "test"})[["test", "value", "u"]].assign(
            label=planned.labels
        ),
        candidates=pd.DataFrame([_candidate(h, study) for h in planned.hypotheses.tested]),
        new_tests=pd.DataFrame({"label": list(uncertainties), "u": list(uncertainties.values())}),
    )
    try:
        return analyser.analyse(table)
    except ValueError as error:
        if type(error).__module__.partition(".")[0] in ("builtins", "numpy"):
            raise  # a fault of the program; what an analyser can't use it tells by an error of its own
        raise InputError(str(error)) from error


def _as_believed(chi2: float) -> list[str]:
    """Return what the runs of the model as it stands say, which no surrogate stands for; nothing where a test failed."""
    return [f"As it is believed, the model misses its measurements by χ² = {chi2:.3g}."] if chi2 == chi2 else []


def _candidate(hypothesis: Hypothesis, study: Study) -> dict[str, Any]:
    effect, parameter = hypothesis.effect, hypothesis.parameter
    return {
        "name": hypothesis.name,
        "title": effect.title,
        "two_sided": effect.two_sided,
        "all_or_nothing": effect.all_or_nothing,
        "parameter": parameter.name,
        "unit": parameter.unit,
        "at_zero": parameter.vanishing,
        "at_full": hypothesis.strength(1.0, study.model()),
    }


def _candidates(planned: Plan, analysed: Any) -> list[dict[str, Any]]:
    """Return the table of candidates with what only the effects know."""
    found = []
    for row in analysed.tables["candidates"].to_dict("records"):
        hypothesis = planned.hypotheses[row["effect"]]
        limit = row["detection_limit"]
        try:
            hypothesis.effect.at_strength(row["detectable_share"], hypothesis.scale, planned.study.model().effects)
        except TaichidemError:
            limit = float("nan")  # beyond what the parameter may be
        notes = ["stronger than anything that was simulated"] if row["beyond_probed"] else []
        if hypothesis.effect.all_or_nothing:
            notes.append("put in wholly or not at all: the strength is that of the whole times its share")
        extra = {"visible_as": hypothesis.effect.visible_as, "note": "; ".join(notes), "detection_limit": limit}
        found.append(row | extra)
    return found


def _errors(rows: pd.DataFrame, errors: pd.DataFrame) -> list[dict[str, Any]]:
    """Return the errors per measurement; those of the believed model come from its own runs."""
    kept = ["experiment", "observable", "condition", "label", "unit", "measured", "u_measured", "z"]
    joined = rows[kept].rename(columns={"z": "believed"}).reset_index(drop=True)
    more = errors[["recalibrated", "with_effect", "held_out_before", "held_out_after"]].reset_index(drop=True)
    return joined.join(more).to_dict("records")


def _next_measurement(planned: Plan, analysed: Any) -> dict[str, Any] | None:
    found = analysed.details["next"]
    if found is None:
        return None
    return {**found, "text": analysed.details["next_text"], **_what_to_measure(planned, found["label"])}


def _what_to_measure(planned: Plan, label: str) -> dict[str, Any]:
    """Return test, settings, observable and unit behind the label of a new test, of a measurement or of a parameter."""
    if label in planned.new_responses:
        name, observable = planned.new_responses[label]
        test = planned.proposals[name].experiment
        settings = test.settings.model_dump()
    elif label in planned.responses:
        name, observable = planned.responses[label]
        test, settings = planned.study.experiment(name), dict(planned.study.experiments[name].settings)
    else:
        unit = next(c.unit for c in planned.study.calibrate if c.key == label)
        return {"experiment": "", "settings": {}, "observable": label, "unit": unit}
    unit = next(o.unit for o in test.observables if o.name == observable)
    return {"experiment": name, "settings": settings, "observable": observable, "unit": unit}


def _design(planned: Plan, analysed: Any) -> dict[str, Any]:
    return {
        "rows": len(planned.design),
        "points": len(planned.design) + len({run.seed for run in planned.believed}),
        "seeds": sorted(set(planned.design["seed"].tolist())),
        "generator": "definitive_screening and latin_hypercube, one block per effect",
        "tests": [*planned.study.experiments, *planned.proposals],
        "seed_scatter": analysed.details["seed_scatter"],
    }


def _pictures(found: Diagnosis) -> dict[str, str]:
    document = found.as_dict()
    written = {
        "waterfall": write_waterfall(document, found.folder),
        "look_alikes": write_look_alikes(document, found.folder),
        "standardised_errors_after": write_standardised_errors(document, found.folder),
    }
    return {name: path.name for name, path in written.items() if path is not None}
