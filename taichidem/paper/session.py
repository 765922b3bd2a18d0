"""What every stage of the reproduction works with: a folder, a store of runs, how much is run; and heaps of a design."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from taichidem.errors import SimulationError
from taichidem.paper.effort import Effort
from taichidem.paper.heaps import coarse_heap, model_at
from taichidem.paper.published import ANGLE
from taichidem.scene import Model
from taichidem.study import Run, RunStore, run_all

Tell = Callable[[str, float], None]
FEWEST = 0.9  # share of the heaps of a design that must have been measured


@dataclass(frozen=True)
class Session:
    """A reproduction under way.

    Attributes:
        folder: where everything is written.
        store: of all runs.
        effort: how much is run.
        tell: called with the stage and the share done.
        executor: workers that simulate the designs and the held-out tests, as for `run_all`.
    """

    folder: Path
    store: RunStore
    effort: Effort
    tell: Tell
    executor: Executor | None = None

    def pour(
        self, stage: str, table: pd.DataFrame, letters: Sequence[str], heaps: int | pd.Series, first_seed: int
    ) -> pd.DataFrame:
        """Return a design with a row per heap: its run, factors, seed, angle of repose [deg], and why one failed.

        Args:
            stage: its name, for progress.
            table: a row per run, with the columns `run` and the factors.
            letters: the factors.
            heaps: per run, one number or one for each.
            first_seed: the seeds of run k are first_seed + 10 k and those that follow.

        Raises:
            SimulationError: more than a tenth of the heaps failed.
        """
        rows = table[["run", *letters]].loc[table.index.repeat(heaps)].reset_index(drop=True)
        rows["seed"] = first_seed + 10 * rows["run"] + rows.groupby("run").cumcount()
        heap = coarse_heap()
        runs = [
            Run(heap, self.model({letter: row[letter] for letter in letters}), int(row["seed"]), stage)
            for row in rows.to_dict("records")
        ]
        found = run_all(runs, self.store, lambda share: self.tell(stage, share), executor=self.executor)
        rows[ANGLE] = found["angle_of_repose"].to_numpy() if "angle_of_repose" in found else np.nan
        rows["reason"] = found["reason"].to_numpy()
        failed = rows[rows[ANGLE].isna()]
        if len(failed) > (1 - FEWEST) * len(rows):
            raise SimulationError(
                f"{len(failed)} of {len(rows)} heaps of the {stage} failed, so it can't be analysed. The first: "
                f"{failed['reason'].iloc[0]}"
            )
        return rows

    def model(self, levels: Mapping[str, float]) -> Model:
        """Return the model at some levels of the paper's factors."""
        return model_at(levels, stiffness=self.effort.stiffness)


def means(rows: pd.DataFrame) -> pd.Series:
    """Return run → mean angle of its heaps [deg]."""
    return rows.groupby("run")[ANGLE].mean()
