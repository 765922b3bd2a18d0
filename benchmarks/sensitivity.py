"""Every effect, weak and strong, on every test of the bench: the change of each observable in units of its uncertainty.

`python -m benchmarks.sensitivity` writes docs/sensitivity.csv, docs/sensitivity_pairs.csv and docs/pictures/sensitivity.png and
prints the comparison with the reference table where that is present. Runs are kept in benchmarks/.cache.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Sequence
from itertools import combinations
from pathlib import Path

import numpy as np
import pandas as pd

from benchmarks.sensitivity_changes import EFFECTS, PARAMETERS, Change
from taichidem.errors import unknown_name
from taichidem.study import Run, RunStore, Study, read_study, run_all

ROOT = Path(__file__).resolve().parents[1]
STUDY = ROOT / "examples" / "bench"
REFERENCE = ROOT.parent / "shared" / "lab" / "sensitivity_reference.csv"
STORE = Path(__file__).parent / ".cache" / "sensitivity.sqlite"
SEEDS = (
    1,
    2,
)  # of the two look-alikes, rolling resistance and cohesion by area; all other changes take the first alone
CENTRE_SEEDS = (1, 2, 3, 4)

# Standard uncertainty of a measurement, as in the bench's reference data; the last four are what such tests reach.
MEASUREMENT_U = {
    ("ledge", "angle_of_repose"): 0.47,
    ("bulk", "bulk_density"): 3.6,
    ("heap", "angle_of_repose"): 0.71,
    ("hopper_36mm", "mass_flow_rate"): 1.7,
    ("hopper_54mm", "mass_flow_rate"): 5.2,
    ("drum_6rpm", "dynamic_angle_of_repose"): 0.53,
    ("drum_20rpm", "dynamic_angle_of_repose"): 0.34,
    ("rebound_0p25m_s", "coefficient_of_restitution"): 0.015,
    ("rebound_0p5m_s", "coefficient_of_restitution"): 0.015,
    ("rebound_1p0m_s", "coefficient_of_restitution"): 0.015,
    ("rebound_2p0m_s", "coefficient_of_restitution"): 0.015,
    ("shear_box", "friction_angle"): 1.0,
    ("shear_box", "cohesion"): 30.0,
    ("lifted_tube", "angle_of_repose"): 0.7,
    ("rolling_ball", "rolling_distance"): 1.0,
}


def measure(
    study: Study, changes: Sequence[Change], store: RunStore, report: Callable[[str, float], None]
) -> pd.DataFrame:
    """Return a row per change and observable: mean, standard deviation over the seeds, number of runs.

    Changes of one name go through the engine together, since they share their compiled law.
    """
    centre = Change("centre", "", "", lambda model: model, "c")
    names = dict.fromkeys(change.name for change in (centre, *changes))
    rows: list[dict] = []
    for name in names:
        together = [change for change in (centre, *changes) if change.name == name]
        runs = [run for change in together for run in _runs(study, change)]
        table = run_all(runs, store, lambda share, name=name: report(name, share))  # type: ignore[misc]
        for change in together:
            keys = {run.key for run in _runs(study, change)}
            rows += _summary(change, table[table["key"].isin(keys)])
    return pd.DataFrame(rows)


def _runs(study: Study, change: Change) -> list[Run]:
    seeds = (
        CENTRE_SEEDS
        if change.name == "centre"
        else SEEDS
        if change.reference and not change.is_parameter
        else SEEDS[:1]
    )
    model = change.apply(study.model())
    tests = dict.fromkeys(test for test, _ in MEASUREMENT_U)
    return [Run(study.experiment(test), model, seed, test) for test in tests for seed in seeds]


def _summary(change: Change, table: pd.DataFrame) -> list[dict]:
    rows = []
    for test, observable in MEASUREMENT_U:
        done = table[(table["experiment"] == test) & (table["status"] == "done")]
        values = done[observable].to_numpy(float) if len(done) else np.empty(0)
        rows.append(
            {
                "change": change.name,
                "level": change.level,
                "setting": change.setting,
                "reference": change.reference,
                "experiment": test,
                "observable": observable,
                "mean": values.mean() if len(values) else np.nan,
                "seed_sd": values.std(ddof=1) if len(values) > 1 else np.nan,
                "n": len(values),
            }
        )
    return rows


def standardise(table: pd.DataFrame) -> pd.DataFrame:
    """Return the table of changes with the shift from the centre, its u_val and their ratio.

    u_val² = u_D² + s²/n + s²/n_centre. With one or two seeds a standard deviation says little, so s is pooled per test over
    all changes.
    """
    key = ["experiment", "observable"]
    spread = table.groupby(key).apply(_pooled, include_groups=False).rename("pooled_sd")
    centre = table[table["change"] == "centre"].set_index(key)
    out = table[table["change"] != "centre"].join(spread, on=key).join(centre[["mean", "n"]], on=key, rsuffix="_centre")
    measurement = pd.Series(MEASUREMENT_U)
    own = np.array([measurement[tuple(row)] for row in out[key].to_numpy()])
    out["shift"] = out["mean"] - out["mean_centre"]
    out["u_shift"] = out["pooled_sd"] * np.sqrt(1 / out["n"] + 1 / out["n_centre"])
    out["u_val"] = np.hypot(own, out["u_shift"])
    out["sensitivity"] = out["shift"] / out["u_val"]
    return out


def _pooled(group: pd.DataFrame) -> float:
    known = group[np.isfinite(group["seed_sd"])]
    degrees = known["n"] - 1
    return float(np.sqrt((known["seed_sd"] ** 2 * degrees).sum() / degrees.sum())) if len(known) else np.nan


def signatures(shifts: pd.DataFrame) -> pd.DataFrame:
    """Return a row per change and a column per test, in units of u_val."""
    named = shifts.assign(
        label=shifts["change"] + " " + shifts["level"], test=shifts["experiment"] + "." + shifts["observable"]
    )
    order = [f"{test}.{observable}" for test, observable in MEASUREMENT_U]
    rows = list(dict.fromkeys(named["label"]))
    return named.pivot(index="label", columns="test", values="sensitivity").loc[rows, order]


def pairs(signature: pd.DataFrame) -> pd.DataFrame:
    """Return, for each pair of strong effects, how alike they are and which test tells them apart best.

    ρ is the cosine between the signatures. The first effect is scaled to imitate the second as well as it can; what is
    then left in a test says how well that test separates the two, in units of u_val.
    """
    strong = signature[signature.index.str.endswith(" strong")].fillna(0.0)
    rows = []
    for first, second in combinations(strong.index, 2):
        a, b = strong.loc[first].to_numpy(), strong.loc[second].to_numpy()
        size = np.linalg.norm(a) * np.linalg.norm(b)
        left = b - a * float(a @ b) / max(float(a @ a), 1e-300)
        best = int(np.abs(left).argmax())
        rows.append(
            {
                "effect": first.removesuffix(" strong"),
                "look_alike": second.removesuffix(" strong"),
                "rho": float(a @ b / size) if size else 0.0,
                "best_test": strong.columns[best],
                "separation": abs(float(left[best])),
                "second_test": strong.columns[int(np.abs(left).argsort()[-2])],
                "all_tests": float(np.linalg.norm(left)),
            }
        )
    return pd.DataFrame(rows)


def against_reference(table: pd.DataFrame, shifts: pd.DataFrame, path: Path) -> pd.DataFrame:
    """Return the shifts that an independent code found for the same changes beside ours, and z of their difference."""
    reference = pd.read_csv(path)
    key = ["experiment", "observable"]
    spread = reference.groupby(key).apply(_pooled, include_groups=False)
    centre = reference[reference["run"] == "c"].set_index(key)
    rows = []
    for row in shifts[shifts["reference"] != ""].to_dict("records"):
        at = (row["experiment"], row["observable"])
        theirs = reference[(reference["run"] == row["reference"]) & (reference[key] == at).all(axis=1)]
        if theirs.empty:
            continue
        shift = float(theirs["mean"].iloc[0] - centre.loc[at, "mean"])
        u = float(spread[at]) * np.sqrt(1 / theirs["n"].iloc[0] + 1 / centre.loc[at, "n"])
        both = float(np.hypot(u, row["u_shift"])) if np.isfinite(row["u_shift"]) else u
        z = (row["shift"] - shift) / both if both else np.nan
        same_sign = (
            np.sign(shift) == np.sign(row["shift"]) or abs(shift) < 2 * u or abs(row["shift"]) < 2 * row["u_shift"]
        )
        rows.append(
            {
                "change": f"{row['change']} {row['level']}",
                "experiment": at[0],
                "ours": row["shift"],
                "theirs": shift,
                "u": both,
                "z": z,
                "sign_agrees": bool(same_sign),
            }
        )
    return pd.DataFrame(rows)


def main(arguments: Sequence[str] | None = None) -> int:
    """Write the tables and the picture, print the comparison with the reference."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.sensitivity", description=__doc__)
    parser.add_argument("--only", nargs="*", help="names of effects or parameters; all by default")
    parser.add_argument("--store", type=Path, default=STORE)
    parser.add_argument("--output", "-o", type=Path, default=ROOT / "docs")
    given = parser.parse_args(arguments)
    from benchmarks.sensitivity_plot import plot
    from taichidem.cli.progress import progress

    known = {c.name for c in (*PARAMETERS, *EFFECTS)}
    for name in given.only or ():
        if name not in known:
            print(f"Error: {unknown_name('change', name, known)}", file=sys.stderr)
            return 2
    if given.only and given.output == ROOT / "docs":
        print("Error: a part of the table must not replace the whole one; name a folder with -o.", file=sys.stderr)
        return 2
    changes = [c for c in (*PARAMETERS, *EFFECTS) if not given.only or c.name in given.only]
    given.store.parent.mkdir(parents=True, exist_ok=True)
    with RunStore(given.store) as store, progress() as report:
        table = measure(read_study(STUDY), changes, store, report)
    shifts = standardise(table)
    signature = signatures(shifts)
    columns = ["change", "level", "setting", "experiment", "observable", "mean", "mean_centre", "shift", "u_val"]
    shifts[[*columns, "sensitivity", "n"]].to_csv(given.output / "sensitivity.csv", index=False, float_format="%.5g")
    pairs(signature).to_csv(given.output / "sensitivity_pairs.csv", index=False, float_format="%.3g")
    plot(signature, given.output / "pictures" / "sensitivity.png")
    print(signature.round(1).to_string())
    if REFERENCE.exists():
        both = against_reference(table, shifts, REFERENCE)
        print(both.round(3).to_string(index=False))
        z = both["z"].dropna().abs()
        wrong = both[~both["sign_agrees"]]
        print(
            f"{len(z)} shifts with seed scatter: mean z² {float((z**2).mean()):.2f}, {int((z > 2.5).sum())} beyond 2.5, "
        )
        print(f"signs disagree in {len(wrong)} of {len(both)}.")
    return 0


if __name__ == "__main__":
    sys.exit(main())
