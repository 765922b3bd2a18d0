"""Reading run tables: which columns are factors, and what is refused."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from analysis import AnalysisError, Anova, MainEffects, ResponseSurface
from analysis.run_table import match_design, read_runs
from designs import BoxBehnken, Factor, FactorSpace
from taichidem.paper.published import central_composite
from tests.analysis.published import filtration_rate


def table(**changes):
    data = {"run": [1, 2, 3, 4], "seed": [9, 8, 7, 6], "a": [0, 1, 0, 1.0], "b": [0, 0, 1, 1.0], "y": [1, 2, 3, 5.0]}
    return pd.DataFrame({**data, **changes})


def test_columns_of_the_run_table_are_never_factors():
    full = table(
        std_order=[1, 2, 3, 4], run_order=[4, 3, 2, 1], block=[1, 1, 2, 2], point_type=["f"] * 4, status=["ok"] * 4
    )
    full["coded a"] = [-1, 1, -1, 1]
    runs = read_runs(full, ["y"])
    assert runs.names == ("a", "b")
    assert runs.n_blocks == 2
    assert list(runs.order) == [4, 3, 2, 1]


def test_factors_narrow_the_rest():
    assert read_runs(table(humidity=[1, 2, 3, 4]), ["y"], factors=["b"]).names == ("b",)


def test_a_space_gives_the_coding():
    space = FactorSpace([Factor("a", 0, 4)])
    np.testing.assert_allclose(read_runs(table(), ["y"], space=space).coded[:, 0], [-1, -0.5, -1, -0.5])


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"y": [1, 2, "wet", 4]}, r"'y' \(response\) holds 'wet' in row 3"),
        ({"y": [1, np.nan, 3, np.nan]}, r"nothing in row 2 and 2 unusable values"),
        ({"y": [1, np.inf, 3, 4]}, "'inf' in row 2"),
        ({"a": [0, 1, "high", 1]}, r"'a' \(factor\) holds 'high' in row 3"),
        ({"a": [1, 1, 1, 1]}, "one value 1 in all 4 runs"),
        ({"operator": ["x", "y", "x", "y"]}, "'operator'"),
        ({"block": [1, np.nan, 2, 2]}, "'block' has gaps"),
    ],
)
def test_bad_columns_are_refused(changes, words):
    with pytest.raises(AnalysisError, match=words):
        read_runs(table(**changes), ["y"])


def test_missing_response_names_the_nearest():
    with pytest.raises(AnalysisError, match="Did you mean 'aor_deg'"):
        MainEffects().analyse(central_composite(), responses=["aor_degree"])


@pytest.mark.parametrize(
    ("factors", "words"),
    [
        (["a", "a"], "named twice"),
        (["a", "y"], "as factor and as response"),
        (["seed"], "never a factor"),
        (["c"], "'c'"),
    ],
)
def test_bad_factor_names_are_refused(factors, words):
    with pytest.raises(AnalysisError, match=words):
        read_runs(table(), ["y"], factors=factors)


def test_doubled_columns_are_refused():
    doubled = table().rename(columns={"b": "a"})
    with pytest.raises(AnalysisError, match="'a' appears twice"):
        read_runs(doubled, ["y"])


def test_an_empty_table_is_refused():
    with pytest.raises(AnalysisError, match="no rows"):
        read_runs(table().head(0), ["y"])


def test_wrong_number_of_responses():
    with pytest.raises(AnalysisError, match="exactly 1"):
        Anova().analyse(table(), responses=["y", "a"])


def test_saturated_model_asked_for_p_values():
    with pytest.raises(AnalysisError, match=r"saturated: 4 coefficients from 4 runs.*main_effects"):
        Anova(model="interactions").analyse(table(), responses=["y"])
    with pytest.raises(AnalysisError, match="saturated"):
        ResponseSurface(terms="A,B,C,D,A*B,A*C,A*D,B*C,B*D,C*D,A*B*C,A*B*D,A*C*D,B*C*D,A*B*C*D").analyse(
            filtration_rate(), responses=["rate"]
        )


def test_too_few_runs_for_the_model():
    with pytest.raises(AnalysisError, match="6 coefficients and the table 4 runs"):
        Anova().analyse(table(), responses=["y"])


def test_aliased_terms_are_named():
    with pytest.raises(AnalysisError, match=r"from the others: A\*A, B\*B, C\*C, D\*D"):
        Anova(model="pure_quadratic").analyse(filtration_rate(), responses=["rate"])


def test_unknown_factor_in_a_term():
    with pytest.raises(ValueError, match="Unknown factor 'Q' in term 'A\\*Q'"):
        Anova(terms="A,A*Q").analyse(filtration_rate(), responses=["rate"])


def test_two_levels_are_needed_for_effects():
    with pytest.raises(AnalysisError, match=r"'F' has 3 levels.*response_surface"):
        MainEffects().analyse(central_composite(), responses=["aor_deg"])


class TestMatchDesign:
    design = BoxBehnken().generate(FactorSpace(Factor(n, 0, 1) for n in "abc")).table

    def test_the_same_runs_in_another_order_match(self):
        match_design(self.design.sample(frac=1, random_state=1), self.design, ["a", "b", "c"])

    def test_missing_and_surplus_runs(self):
        changed = self.design.copy()
        changed.loc[0, "run"] = 99
        with pytest.raises(AnalysisError, match=r"missing runs \[1\], surplus runs \[99\]"):
            match_design(changed, self.design, ["a"])

    def test_doubled_run(self):
        with pytest.raises(AnalysisError, match="run 1 more than once"):
            match_design(pd.concat([self.design, self.design.head(1)]), self.design, ["a"])

    def test_changed_value(self):
        changed = self.design.copy()
        changed.loc[3, "b"] += 0.01
        with pytest.raises(AnalysisError, match=r"Run 4 of the table has b = .*1 runs differ"):
            match_design(changed, self.design, ["a", "b"])

    def test_no_run_column(self):
        with pytest.raises(AnalysisError, match="no column 'run'"):
            match_design(self.design.drop(columns="run"), self.design, ["a"])
