"""How often the search for a missing effect is right, on an analytic simulator: `python -m benchmarks.effect_toy_rates`.

Prints a row per hidden truth as it stands in docs/missing_effect.md. A few minutes on one core.
"""

from __future__ import annotations

import argparse
from collections import Counter

from scipy import stats

from analysis.missing_effect.verdict import (
    CANNOT_TELL,
    EFFECT,
    NOTHING_MISSING,
    ONE_OF,
    SOMETHING_ELSE,
    Verdict,
    decide,
)
from benchmarks.effect_toy import BENCH, BULK, NOISY, OUTSIDE, Kind, Toy

SIMULATORS = 10
Truth = tuple[int, ...] | str
WEAK, STRONG = 0.3, 0.8
CASES: tuple[tuple[str, Kind, Truth, float], ...] = (
    ("nothing", BENCH, (), 0.0),
    ("one with a look-alike, weak", BENCH, (0,), WEAK),
    ("one with a look-alike, strong", BENCH, (0,), STRONG),
    ("one without, weak", BENCH, (2,), WEAK),
    ("one without, strong", BENCH, (2,), STRONG),
    ("outside the library, weak", BENCH, OUTSIDE, WEAK),
    ("outside the library, strong", BENCH, OUTSIDE, STRONG),
    ("two at once, strong", BENCH, (2, 4), STRONG),
    ("bulk tests only: nothing", BULK, (), 0.0),
    ("bulk tests only: one that friction imitates, strong", BULK, (2,), STRONG),
    ("u twelve times as large: nothing", NOISY, (), 0.0),
    ("u twelve times as large: one, strong", NOISY, (2,), STRONG),
)
COLUMNS = ("nothing missing", "can't tell", "effect, right", "one of, with the right one", "effect, wrong")
LAST = ("one of, without it", "something else", "of these with a pair")


def counted(verdict: Verdict, truth: Truth) -> str:
    """Return the column that a verdict belongs to."""
    if verdict.word in (NOTHING_MISSING, CANNOT_TELL, SOMETHING_ELSE):
        return {NOTHING_MISSING: COLUMNS[0], CANNOT_TELL: COLUMNS[1], SOMETHING_ELSE: LAST[1]}[verdict.word]
    right = truth != OUTSIDE and bool({k for t in verdict.named for k in t.effects} & set(truth))
    return {EFFECT: (COLUMNS[4], COLUMNS[2]), ONE_OF: (LAST[0], COLUMNS[3])}[verdict.word][right]


def rates(toys: list[Toy], truth: Truth, strength: float, count: int) -> Counter[str]:
    """Return how often each column came up in a number of trials."""
    seen: Counter[str] = Counter()
    for i in range(count):
        verdict = decide(toys[i % len(toys)].search(truth, strength, 5000 + i))
        seen[counted(verdict, truth)] += 1
        seen[LAST[2]] += verdict.word == SOMETHING_ELSE and bool(verdict.named)
    return seen


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--trials", type=int, default=200, help="of each truth")
    count, columns = parser.parse_args().trials, (*COLUMNS, *LAST)
    toys = {kind: [Toy(seed, kind) for seed in range(SIMULATORS)] for kind in (BENCH, BULK, NOISY)}
    print("| hidden | " + " | ".join(columns) + " |\n|---|" + "---|" * len(columns))
    for title, kind, truth, strength in CASES:
        seen = rates(toys[kind], truth, strength, count)
        print(f"| {title} | " + " | ".join(f"{100 * seen[c] / count:.3g}" for c in columns) + " |", flush=True)
        if title == "nothing":
            alarms = count - seen[COLUMNS[0]] - seen[COLUMNS[1]]
            interval = stats.binomtest(alarms, count).proportion_ci(method="exact")
    print(f"\nFalse alarms on the bench: {alarms} of {count}, 95 % interval {interval.low:.1%} to {interval.high:.1%}.")


if __name__ == "__main__":
    main()
