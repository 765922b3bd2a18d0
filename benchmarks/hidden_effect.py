"""Make the measurements of examples/hidden_effect: `python -m benchmarks.hidden_effect --output examples/hidden_effect`.

They are simulated by our own engine on the study's own tests, with an effect that its model lacks, other parameters than it
starts from and other seeds, and an instrument's error is added. The truth goes to made_with.json, which the study doesn't read.
"""

from __future__ import annotations

import argparse
import json
import tempfile
from pathlib import Path

import numpy as np

from benchmarks.planted import (
    HISTORY_SEEDS,
    INSTRUMENT,
    Truth,
    direct,
    measure,
    repeatability,
    truth_runs,
    write_variant,
)
from taichidem.study import RunStore, read_study, run_all
from taichidem.study.hypothesis import hypotheses

STUDY = Path(__file__).parent.parent / "examples" / "hidden_effect"
NOISE_SEED = 5
TRUTH = Truth(
    values={
        "normal_hertz.restitution": 0.53,
        "bead-bead.static_friction": 0.45,
        "bead-wall.static_friction": 0.26,
    },
    shares={"rolling_constant_torque": 0.5},
    first_seed=2001,
)


def make(folder: Path) -> Path:
    """Write study.toml with the parameters as measured, measurements.csv and made_with.json; return the last."""
    study = read_study(STUDY)
    known = hypotheses(study, TRUTH.shares)
    rng = np.random.default_rng(NOISE_SEED)
    with tempfile.TemporaryDirectory() as kept, RunStore(Path(kept) / "runs.sqlite") as store:
        table = run_all(truth_runs(study, known, TRUTH), store)
        rows = measure(study, table, repeatability(study, store), rng)
    write_variant(study, folder, rows, direct(study, TRUTH, rng), believe=True)
    hidden = {name: known[name].at(share, study.model()).values for name, share in TRUTH.shares.items()}
    document = {
        "hidden_effects": hidden,
        "parameters": dict(TRUTH.values),
        "seeds": list(TRUTH.seeds),
        "noise_seed": NOISE_SEED,
        "instrument": {name: {"absolute": a, "share": s} for name, (a, s) in INSTRUMENT.items()},
        "seeds_of_the_scatter": list(HISTORY_SEEDS),
    }
    path = folder / "made_with.json"
    path.write_text(json.dumps(document, indent=2) + "\n", encoding="utf-8")
    return path


def main() -> None:
    """Read the arguments, make, say where."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--output", type=Path, required=True, help="folder for the study")
    print(f"wrote {make(parser.parse_args().output)}")


if __name__ == "__main__":
    main()
