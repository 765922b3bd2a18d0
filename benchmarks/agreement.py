"""Our bench against data that an independent code made, with the true parameters: S − D of every observable, in units of u_val.

`python -m benchmarks.agreement` simulates the studies pub-a (nothing hidden), pub-b (rolling resistance) and pub-c (cohesion)
with what answers.csv says is true. Runs are kept in benchmarks/.cache, so that a repeated call costs nothing.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from taichidem.effects import CohesionArea, RollingConstantTorque
from taichidem.effects.base import Effect
from taichidem.errors import InputError
from taichidem.scene import Model
from taichidem.study import Run, RunStore, Study, read_measurements, read_study, run_all

STUDIES = Path(__file__).resolve().parents[2] / "shared" / "lab" / "studies"
STORE = Path(__file__).parent / ".cache" / "agreement.sqlite"
SEEDS = (1, 2, 3, 4)
FEW, NONE_BEYOND = 2.5, 3.5  # |E|/u_val that one observable of a study may pass, and that none may
EXCEPTIONS = 1

PARAMETERS = {
    "restitution_pp": "granule-granule.restitution",
    "restitution_pw": "granule-wall.restitution",
    "static_friction_pp": "granule-granule.static_friction",
    "static_friction_pw": "granule-wall.static_friction",
}
# What the column effect_parameters of answers.csv says in words.
HIDDEN: Mapping[str, Sequence[Effect]] = {
    "pub-a": (),
    "pub-b": (RollingConstantTorque(rolling_friction=0.12),),
    "pub-c": (CohesionArea(energy_density={"granule-granule": 4e4, "granule-wall": 2e4, "wall-wall": 0.0}),),
}


@dataclass(frozen=True)
class Row:
    """One observable: simulated S ± u_S (seeds), measured D ± u_D."""

    study: str
    experiment: str
    observable: str
    unit: str
    simulated: float
    simulated_u: float
    measured: float
    measured_u: float

    @property
    def error(self) -> float:
        """E = S − D."""
        return self.simulated - self.measured

    @property
    def validation_u(self) -> float:
        """u_val = √(u_S² + u_D²)."""
        return float(np.hypot(self.simulated_u, self.measured_u))

    @property
    def standardised(self) -> float:
        """E / u_val."""
        return self.error / self.validation_u


def true_model(study: Study, folder: Path) -> Model:
    """Return a study's model with what answers.csv says is true, hidden effect included."""
    answers = pd.read_csv(folder / "answers.csv", index_col="study")
    answer = answers.loc[study.path.name]
    model = study.model_with({key: float(answer[column]) for column, key in PARAMETERS.items()})
    return Model(model.materials, [*model.effects, *HIDDEN[study.path.name]])


def rows_of(study: Study, table: pd.DataFrame) -> list[Row]:
    """Return the comparison of every measured observable with the runs of its experiment."""
    rows = []
    for m in read_measurements(study).to_dict("records"):
        runs = table[(table["experiment"] == m["experiment"]) & (table["status"] == "done")]
        if runs.empty or m["observable"] not in runs:
            raise InputError(
                f"{study.path.name}: no run of {m['experiment']} gave {m['observable']}; its failures are above."
            )
        values = runs[m["observable"]].to_numpy(float)
        scatter = float(values.std(ddof=1) / np.sqrt(len(values))) if len(values) > 1 else 0.0
        own = (m["experiment"], m["observable"], m["unit"], float(values.mean()), scatter, m["value"], m["u"])
        rows.append(Row(study.path.name, *own))
    return rows


def compare(
    names: Sequence[str], seeds: Sequence[int], folder: Path, store: RunStore, report: Callable[[str, float], None]
) -> list[Row]:
    """Simulate the studies and return a row per observable.

    Raises:
        InputError: a study is not there, or nothing of an experiment could be simulated.
    """
    rows = []
    for name in names:
        if name not in HIDDEN:
            raise InputError(f"The true effect of {name!r} isn't known here; allowed: {', '.join(HIDDEN)}.")
        study = read_study(folder / name)
        model = true_model(study, folder)
        runs = [Run(study.experiment(test), model, seed, test) for test in study.experiments for seed in seeds]
        table = run_all(runs, store, lambda share, name=name: report(name, share))  # type: ignore[misc]
        for failed in table[table["status"] != "done"].to_dict("records"):
            print(f"{name} {failed['experiment']} seed {failed['seed']} failed: {failed['reason']}", file=sys.stderr)
        rows += rows_of(study, table)
    return rows


def agrees(rows: Sequence[Row]) -> bool:
    """Return True if at most one observable of each study passes 2.5 u_val and none passes 3.5."""
    for name in {row.study for row in rows}:
        sizes = [abs(row.standardised) for row in rows if row.study == name]
        if not np.all(np.isfinite(sizes)) or max(sizes) > NONE_BEYOND or sum(z > FEW for z in sizes) > EXCEPTIONS:
            return False
    return True


def as_text(rows: Sequence[Row]) -> str:
    """Return the table and the verdict."""
    lines = [
        f"{'study':6} {'experiment':16} {'observable':28} {'S ± u':>17} {'D ± u':>17} {'E':>8} {'u_val':>7} |E|/u_val"
    ]
    for r in rows:
        digits = 3 if r.unit == "1" else 2
        pair = [
            f"{v:.{digits}f} ± {u:.{digits}f}" for v, u in ((r.simulated, r.simulated_u), (r.measured, r.measured_u))
        ]
        lines.append(
            f"{r.study:6} {r.experiment:16} {r.observable + ' [' + r.unit + ']':28} {pair[0]:>17} {pair[1]:>17} "
            f"{r.error:8.{digits}f} {r.validation_u:7.{digits}f} {abs(r.standardised):8.2f}"
        )
    for name in dict.fromkeys(row.study for row in rows):
        sizes = np.array([abs(row.standardised) for row in rows if row.study == name])
        lines.append(
            f"{name}: {np.count_nonzero(sizes <= FEW)} of {len(sizes)} within {FEW} u_val, largest {sizes.max():.2f}, "
            f"χ² {float((sizes**2).sum()):.1f}."
        )
    return "\n".join([*lines, f"The two codes {'agree' if agrees(rows) else 'do NOT agree'}."])


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table; the exit status is 0 if the codes agree."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.agreement", description=__doc__)
    parser.add_argument("studies", nargs="*", default=list(HIDDEN), help="names of studies")
    parser.add_argument("--folder", type=Path, default=STUDIES, help="where the studies and answers.csv are")
    parser.add_argument("--seeds", type=int, nargs="+", default=SEEDS)
    parser.add_argument("--store", type=Path, default=STORE, help="run store that keeps what was simulated")
    given = parser.parse_args(arguments)
    from taichidem.cli.progress import progress

    given.store.parent.mkdir(parents=True, exist_ok=True)
    try:
        with RunStore(given.store) as store, progress() as report:
            rows = compare(given.studies, given.seeds, given.folder, store, report)
    except InputError as error:
        print(f"Error: {error}", file=sys.stderr)
        return 2
    print(as_text(rows))
    return 0 if agrees(rows) else 1


if __name__ == "__main__":
    sys.exit(main())
