"""Seconds for D-optimal augmentation: 200 candidates in 10 factors, and how it grows.

Run ``python benchmarks/bench_d_optimal.py``; the promise is less than 2 s for the first line.
"""

from __future__ import annotations

import time

from designs import DOptimal, Factor, FactorSpace, LatinHypercube


def seconds(n_factors: int, n_candidates: int, n_existing: int, n_added: int, fit: str) -> tuple[float, float]:
    """Return the seconds of one augmentation and the D-efficiency it reaches."""
    space = FactorSpace(Factor(f"x{i}", 0, 1) for i in range(n_factors))
    existing = LatinHypercube(runs=n_existing).generate(space, seed=1).table
    candidates = LatinHypercube(runs=n_candidates).generate(space, seed=2).natural
    generator = DOptimal(existing=existing, candidates=candidates, added_runs=n_added, fit=fit)
    start = time.perf_counter()
    design = generator.generate(space)
    return time.perf_counter() - start, design.d_efficiency()


def main() -> None:
    """Print one line per case."""
    print("factors  candidates  existing  added  model          seconds  D-efficiency")
    cases = [(10, 200, 60, 30, "quadratic"), (10, 200, 12, 30, "linear"), (10, 2000, 60, 60, "quadratic")]
    for k, candidates, existing, added, fit in [*cases, (20, 1000, 40, 40, "linear")]:
        used, efficiency = seconds(k, candidates, existing, added, fit)
        print(f"{k:7d}  {candidates:10d}  {existing:8d}  {added:5d}  {fit:13s}  {used:7.3f}  {efficiency:8.1f} %")


if __name__ == "__main__":
    main()
