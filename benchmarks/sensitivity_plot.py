"""The heat map of the sensitivity table."""

from __future__ import annotations

from pathlib import Path

import matplotlib
import numpy as np
import pandas as pd

matplotlib.use("Agg")
import matplotlib.pyplot as plt

FULL = 10.0  # units of u_val at which the colour is full


def plot(signature: pd.DataFrame, path: Path) -> None:
    """Draw changes as rows and tests as columns, coloured by the shift in units of u_val, with the number in each field."""
    height = 1.6 + 0.27 * len(signature)
    figure, axes = plt.subplots(figsize=(11, height), layout="constrained")
    values = signature.to_numpy(float)
    picture = axes.imshow(np.clip(values, -FULL, FULL), cmap="RdBu_r", vmin=-FULL, vmax=FULL, aspect="auto")
    axes.set_xticks(range(values.shape[1]), [_short(name) for name in signature.columns], rotation=45, ha="right")
    axes.set_yticks(range(values.shape[0]), [name.replace("_", " ") for name in signature.index])
    for (row, column), value in np.ndenumerate(values):
        text = "–" if not np.isfinite(value) else f"{value:+.1f}" if abs(value) >= 0.95 else "·"
        axes.text(column, row, text, ha="center", va="center", fontsize=7, color="white" if abs(value) > 6 else "black")
    figure.colorbar(picture, ax=axes, label="shift of the observable / u_val", shrink=0.6)
    axes.set_title("What each effect and parameter does to each test (· is below one u_val)")
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=110)
    plt.close(figure)


def _short(name: str) -> str:
    test, _, observable = name.partition(".")
    return (
        f"{test} ({observable.replace('_', ' ')})" if test in ("shear_box", "lifted_tube") else test.replace("_", " ")
    )
