"""Checks that every design generator must pass, the built-in ones and those of outside packages.

In the tests of an outside package::

    from designs.conformance import check_generator

    def test_my_design():
        check_generator(MyDesign)
"""

from __future__ import annotations

from typing import Any

import numpy as np

from designs.base import DesignGenerator
from designs.design import Design
from designs.errors import DesignError
from designs.space import RESERVED_COLUMNS, Factor, FactorSpace

_SIZES = (2, 3, 4, 5, 7)
_IMPOSSIBLE_RUNS = 13


def sample_space(n_factors: int) -> FactorSpace:
    """Return a space of factors with unlike ranges, one of them on a log scale."""
    factors = [Factor("friction", 0.1, 0.6), Factor("modulus", 1e6, 1e9, "Pa", log=True)]
    factors += [Factor(f"factor_{i}", -1.0 - i, 2.0 * i, "mm") for i in range(2, n_factors)]
    return FactorSpace(factors[:n_factors])


def check_generator(generator: type[DesignGenerator]) -> None:
    """Run all checks on a generator class with its default settings.

    Raises:
        AssertionError: for the first check that fails, saying which.
    """
    _check_declaration(generator)
    made = [design for design in (_try(generator, n) for n in _SIZES) if design is not None]
    _require(made, f"{generator.name} makes no design for any of {_SIZES} factors")
    for design in made:
        _check_table(design)
        _check_values(design)
        _check_reproducible(generator, design)
        _check_replicates(generator, design)
        _check_bounds(generator, design)
    _check_runs(generator, made[0])


def _require(condition: Any, message: str) -> None:
    """Raise an ``AssertionError`` with the message unless the condition holds (``assert`` would vanish under -O)."""
    if not condition:
        raise AssertionError(message)


def _check_declaration(generator: type[DesignGenerator]) -> None:
    _require(generator.name.isidentifier() and generator.name == generator.name.lower(), f"bad name {generator.name!r}")
    _require(len(generator.summary()) > 20, f"{generator.name} needs a docstring whose first line says what it is")
    _require(set(generator.settings()) >= {"runs", "replicates"}, f"{generator.name} hides the common settings")


def _try(generator: type[DesignGenerator], n_factors: int) -> Design | None:
    """Return the design, or None when it says clearly that it can't be made for so many factors."""
    try:
        return generator().generate(sample_space(n_factors), seed=1)
    except DesignError as error:
        _require(generator.name in str(error), f"the refusal doesn't name the design: {error}")
        return None


def _check_table(design: Design) -> None:
    table, n = design.table, len(design)
    _require(tuple(table.columns) == (*RESERVED_COLUMNS, *design.space.names), f"columns are {list(table.columns)}")
    for column in ("run", "std_order", "run_order"):
        _require(sorted(table[column]) == list(range(1, n + 1)), f"{column} is no permutation of 1 … {n}")
    _require(table["run_order"].is_monotonic_increasing, "rows aren't in run order")
    _require(table["seed"].is_unique and (table["seed"] > 0).all(), "seeds of runs must differ and be positive")
    _require(table["seed"].max() < 2**31, "a seed is too large for a 32-bit integer")
    _require(table["block"].min() == 1 and table["block"].is_monotonic_increasing, "blocks must be done one by one")
    _require(table["point_type"].str.len().min() > 0, "a run has no point type")


def _check_values(design: Design) -> None:
    coded = design.coded.to_numpy()
    _require(np.isfinite(coded).all(), "a coded value isn't finite")
    np.testing.assert_allclose(design.space.to_coded(design.natural), coded, atol=1e-9, err_msg="natural ≠ coded")
    inside = (design.table["point_type"] != "axial").to_numpy()
    _require((np.abs(coded[inside]) <= 1 + 1e-12).all(), "a run that isn't axial lies outside low … high")
    _require(
        0.0 < design.d_efficiency("linear") <= 100.0 + 1e-9 or (np.abs(coded) > 1).any(), "main effects not estimable"
    )
    _require(design.text(), "the design says nothing about itself")


def _check_reproducible(generator: type[DesignGenerator], design: Design) -> None:
    again = generator().generate(design.space, seed=1)
    _require(again.table.equals(design.table), "the same seed gave another design")
    other = generator().generate(design.space, seed=2)
    _require(not other.table["seed"].equals(design.table["seed"]), "another seed gave the same run seeds")
    if len(design) > 4:
        _require(not other.table["std_order"].equals(design.table["std_order"]), "another seed gave the same run order")


def _check_replicates(generator: type[DesignGenerator], design: Design) -> None:
    twice = generator(replicates=2).generate(design.space, seed=1)
    _require(len(twice) == 2 * len(design), f"two replicates of {len(design)} runs gave {len(twice)}")
    _require(twice.table["seed"].is_unique, "replicates share a seed")
    repeats = twice.table.groupby([*design.space.names, "block"]).size()
    _require((repeats % 2 == 0).all(), "a run wasn't repeated in its block")


def _check_bounds(generator: type[DesignGenerator], design: Design) -> None:
    tight = FactorSpace(
        Factor(f.name, f.low, f.high, f.unit, log=f.log, lowest=f.low, highest=f.high) for f in design.space
    )
    try:
        bounded = generator().generate(tight, seed=1)
    except DesignError as error:
        _require("physical bounds" in str(error), f"the refusal doesn't say that a bound was passed: {error}")
        return
    for factor in tight:
        _require(
            bounded.natural[factor.name].between(factor.low - 1e-9, factor.high * (1 + 1e-12) + 1e-9).all(),
            "a value lies outside its physical bounds",
        )


def _check_runs(generator: type[DesignGenerator], design: Design) -> None:
    """A number of runs is met exactly or refused with the nearest numbers."""
    same = generator(runs=len(design)).generate(design.space, seed=1)
    _require(len(same) == len(design), f"asked for {len(design)} runs, got {len(same)}")
    try:
        odd = generator(runs=_IMPOSSIBLE_RUNS).generate(design.space, seed=1)
    except DesignError as error:
        _require(any(character.isdigit() for character in str(error).split("nearest")[-1]), f"no counts named: {error}")
        return
    _require(len(odd) == _IMPOSSIBLE_RUNS, f"asked for {_IMPOSSIBLE_RUNS} runs, got {len(odd)}")
