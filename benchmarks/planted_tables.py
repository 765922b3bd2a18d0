"""Tables and picture of planted truth: confusion of verdicts, shares with binomial intervals."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from scipy.stats import beta

from benchmarks.planted_cases import STRONG, WEAK

VERDICTS = ("nothing_missing", "effect", "one_of", "something_else", "cannot_tell", "refused")
ALARMS = ("effect", "one_of", "something_else")
KINDS = ("nothing", "weak", "strong", "pair", "removed", "removed_kin")
IN_WORDS = {
    "nothing": "nothing missing",
    "weak": "one effect, weak",
    "strong": "one effect, strong",
    "pair": "two effects, strong",
    "removed": "strong, not in the library",
    "removed_kin": "strong, kin not in the library either",
}


def interval(right: float, trials: int, level: float = 0.95) -> tuple[float, float]:
    """Return Clopper and Pearson's interval of a share."""
    tail = (1 - level) / 2
    low = 0.0 if right == 0 else float(beta.ppf(tail, right, trials - right + 1))
    high = 1.0 if right == trials else float(beta.ppf(1 - tail, right + 1, trials - right))
    return low, high


def holds(row: pd.Series) -> bool:
    """Return whether a verdict names what was hidden, all of it, alone or among others."""
    return set(str(row["hidden"]).split(" + ")) <= set(str(row["named"]).split())


def visible(table: pd.DataFrame) -> pd.Series:
    """Return where the hidden effect was stronger than what these data show with 80 % probability."""
    strength = table["kind"].map({"weak": WEAK, "strong": STRONG})
    return table["detection_share"] <= strength


def share(flags: pd.Series) -> str:
    """Return a share with its interval, as text."""
    right, trials = int(flags.sum()), len(flags)
    if trials == 0:
        return "–"
    low, high = interval(right, trials)
    return f"{right} of {trials}, {100 * right / trials:.0f} % ({100 * low:.0f} … {100 * high:.0f} %)"


def truths(flags: pd.Series, table: pd.DataFrame) -> str:
    """Return the share of truths for which something holds in most draws, with its interval; these are independent."""
    return share(flags.groupby(table.loc[flags.index, "case"]).mean() > 0.5)


def print_tables(table: pd.DataFrame) -> None:
    """Print the tables as Markdown."""
    print("\n| truth | " + " | ".join(VERDICTS) + " |\n|---|" + "---|" * len(VERDICTS))
    for kind in KINDS:
        rows = table[table["kind"] == kind]
        print(f"| {IN_WORDS[kind]} | " + " | ".join(str(int((rows["verdict"] == v).sum())) for v in VERDICTS) + " |")
    summary = summarise(table)
    print("\n| question | sets of measurements (95 % interval) | truths (95 % interval) |\n|---|---|---|")
    for question, flags in summary.items():
        print(f"| {question} | {share(flags)} | {truths(flags, table)} |")
    print("\n| hidden | strength | named, alone or in a class | verdicts | most often named |\n|---|---|---|---|---|")
    for (hidden, kind), rows in table[table["kind"].isin(["weak", "strong", "pair"])].groupby(["hidden", "kind"]):
        words = ", ".join(f"{v} {n}" for v, n in rows["verdict"].value_counts().items())
        first = rows["named"].fillna("").mode().iat[0] or "–"
        print(f"| {hidden} | {kind} | {int(rows.apply(holds, axis=1).sum())} of {len(rows)} | {words} | {first} |")


def summarise(table: pd.DataFrame) -> dict[str, pd.Series]:
    """Return for each question a flag per set of measurements."""
    held = table.apply(holds, axis=1)
    alarm = table["verdict"].isin(ALARMS)
    confident = table["verdict"].isin(["effect", "one_of"])
    single = table["verdict"] == "effect"
    seen = visible(table)
    kind = table["kind"]
    found = {"false alarm, nothing missing": alarm[kind == "nothing"]}
    for name in ("strong", "weak"):
        found[f"named, {name}, all effects"] = held[kind == name]
        found[f"named, {name}, effects that the bench can show"] = held[(kind == name) & seen]
        found[f"something else named, {name}"] = (confident & ~held)[kind == name]
    found["pair: both named"] = held[kind == "pair"]
    found["pair: alarm"] = alarm[kind == "pair"]
    for name in ("removed", "removed_kin"):
        found[f"{IN_WORDS[name]}: one library effect named"] = single[kind == name]
        found[f"{IN_WORDS[name]}: a class named"] = (confident & ~single)[kind == name]
    return found


def draw(table: pd.DataFrame, path: Path) -> None:
    """Draw verdicts by truth, a bar of shares per kind and per effect at its strong setting."""
    strong = table[table["kind"] == "strong"].assign(label=lambda t: t["hidden"] + ", strong")
    rows = pd.concat([table.assign(label=table["kind"].map(IN_WORDS)), strong])
    labels = [*[IN_WORDS[k] for k in KINDS if k in set(table["kind"])], *sorted(set(strong["label"]))]
    shares = {v: [float((rows[rows["label"] == x]["verdict"] == v).mean()) for x in labels] for v in VERDICTS}
    figure = Figure(figsize=(9, 0.32 * len(labels) + 1.3), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    colours = ("#9aa5b1", "#1b7837", "#7fbf7b", "#e08214", "#dfc27d", "#333333")
    left = np.zeros(len(labels))
    for verdict, colour in zip(VERDICTS, colours, strict=True):
        axes.barh(labels, shares[verdict], left=left, color=colour, label=verdict.replace("_", " "), height=0.8)
        left = left + np.array(shares[verdict])
    axes.invert_yaxis()
    axes.set(xlim=(0, 1), xlabel="share of verdicts")
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(ncols=3, loc="lower center", bbox_to_anchor=(0.4, 1.0), frameon=False)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=130)
