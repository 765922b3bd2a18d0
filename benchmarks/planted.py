"""Measurements with a known answer: simulate a study's tests with other parameters and a hidden effect, and add noise.

A truth is simulated with seeds of its own, four repeats of each test as a laboratory would make them. What is measured is their
mean and an error of the instrument; the standard uncertainty holds both,

    u² = u_instrument² + s²/n,

s being the scatter of single repeats as it is known from many repeats of that test and from the four themselves.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
import tomlkit

from taichidem.scene import Model
from taichidem.study import RunStore, Study, read_study, run_all
from taichidem.study.campaign import study_runs
from taichidem.study.execution import Run
from taichidem.study.hypothesis import Hypotheses

REPEATS = 4
HISTORY_SEEDS = tuple(range(501, 517))  # repeats of the model as believed, which tell how much a test scatters
# Standard uncertainty of the instrument by observable: absolute in its unit, and as a share of the value.
INSTRUMENT = {
    "bulk_density": (0.0, 0.005),
    "mass_flow_rate": (0.0, 0.01),
    "rolling_distance": (1.0, 0.0),
    "angle_of_repose": (0.7, 0.0),
    "dynamic_angle_of_repose": (0.4, 0.0),
    "coefficient_of_restitution": (0.015, 0.0),
}


@dataclass(frozen=True)
class Truth:
    """What really acts.

    Args:
        values: key under [calibrate] → true number.
        shares: hidden effect → share of its strongest setting; none for a model that lacks nothing.
        first_seed: of the repeats.
    """

    values: Mapping[str, float]
    shares: Mapping[str, float]
    first_seed: int

    @property
    def seeds(self) -> range:
        """Seeds of the repeats."""
        return range(self.first_seed, self.first_seed + REPEATS)


def true_model(study: Study, known: Hypotheses, truth: Truth) -> Model:
    """Return the model that holds in truth."""
    model = study.at(truth.values).model
    for name, share in truth.shares.items():
        model = known[name].joined(model, share)
    return model


def truth_runs(study: Study, known: Hypotheses, truth: Truth) -> list[Run]:
    """Return the runs of the repeats of every test."""
    return study_runs(study, None, list(truth.seeds), [true_model(study, known, truth)])


def observed(study: Study) -> list[tuple[str, str]]:
    """Return test and observable of every measurement to be made, the first observable of each test."""
    return [(name, study.experiment(name).observables[0].name) for name in study.experiments]


def repeatability(study: Study, store: RunStore) -> dict[str, float]:
    """Return by test the standard deviation of a single repeat, from many of them on the model as believed."""
    table = run_all(study_runs(study, None, HISTORY_SEEDS), store)
    return {name: float(_values(table, name, what).std(ddof=1)) for name, what in observed(study)}


def measure(study: Study, table: pd.DataFrame, scatter: Mapping[str, float], rng: np.random.Generator) -> pd.DataFrame:
    """Return the rows of measurements.csv from the outcomes of a truth's runs, noise added; none of tests that all failed.

    Args:
        study: whose tests were run.
        table: as `run_all` returns it for `truth_runs`.
        scatter: as `repeatability` returns it.
        rng: of the instruments' errors.
    """
    rows = []
    for name, what in observed(study):
        values = _values(table, name, what)
        if len(values) < 2:
            continue  # a laboratory would have nothing to write down either
        absolute, share = INSTRUMENT[what]
        instrument = float(np.hypot(absolute, share * values.mean()))
        u = float(np.sqrt(instrument**2 + pooled(values, scatter[name]) ** 2 / len(values)))
        value = float(values.mean() + instrument * rng.standard_normal())
        unit = next(o.unit for o in study.experiment(name).observables if o.name == what)
        rows.append([name, what, f"{value:.4g}", f"{u:.2g}", unit, len(values)])
    return pd.DataFrame(rows, columns=["experiment", "observable", "value", "u", "unit", "n"])


def _values(table: pd.DataFrame, name: str, observable: str) -> pd.Series:
    """Return what the repeats of a test gave that succeeded."""
    column = table[observable] if observable in table else pd.Series(np.nan, table.index)
    return column[table["experiment"] == name].dropna()


def pooled(values: pd.Series, history: float) -> float:
    """Return the scatter of single repeats from these and from the many of before, weighted by degrees of freedom."""
    own, before = len(values) - 1, len(HISTORY_SEEDS) - 1
    return float(np.sqrt((own * values.var(ddof=1) + before * history**2) / (own + before)))


def direct(study: Study, truth: Truth, rng: np.random.Generator) -> dict[str, float]:
    """Return what direct measurements of parameters give, where the study has any: the truth and an error."""
    found = {}
    for entry in study.calibrate:
        if entry.u is not None:
            found[entry.key] = round(truth.values[entry.key] + entry.u * rng.standard_normal(), 3)
    return found


def write_variant(
    study: Study, folder: Path, rows: pd.DataFrame, values: Mapping[str, float], *, believe: bool = False
) -> Study:
    """Write a study that differs in its measurements and in what was measured of parameters, and return it.

    Args:
        study: from which everything else is taken.
        folder: to write into.
        rows: as `measure` returns them.
        values: as `direct` returns them.
        believe: whether the model starts from these values too; where not, runs of the believed model are shared by all variants.
    """
    folder.mkdir(parents=True, exist_ok=True)
    document = tomlkit.parse(study.file.read_text(encoding="utf-8"))
    for key, value in values.items():
        document["calibrate"][key]["value"] = value  # type: ignore[index]
        if believe:
            pair, parameter = key.split(".")
            document["contacts"][pair][parameter] = value  # type: ignore[index]
    (folder / "study.toml").write_text(tomlkit.dumps(document), encoding="utf-8")
    rows.to_csv(folder / "measurements.csv", index=False)
    return read_study(folder)
