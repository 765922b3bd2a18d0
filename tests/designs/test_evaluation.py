"""Alias structure, D-efficiency and power."""

from __future__ import annotations

import numpy as np
import pytest
from statsmodels.stats.power import TTestIndPower

from designs import (
    BoxBehnken,
    Design,
    DesignError,
    Factor,
    FactorSpace,
    FractionalFactorial,
    FullFactorial,
    PlackettBurman,
)
from designs.evaluation import d_efficiency


def space(k):
    return FactorSpace(Factor(name, 0, 1) for name in "ABCDEFGHJ"[:k])


def aliases(design, term):
    table = design.alias_table()
    return dict(table[table["term"] == term][["alias", "coefficient"]].itertuples(index=False))


def test_aliases_of_a_resolution_three_fraction():
    """2^(5−2), D = AB, E = AC (Box, Hunter & Hunter): A with BD and CE, and so on; BC and DE coincide."""
    design = FractionalFactorial(generators="D=AB,E=AC").generate(space(5))
    assert aliases(design, "A") == pytest.approx({"B*D": 1, "C*E": 1})
    assert aliases(design, "B") == pytest.approx({"A*D": 1})
    assert aliases(design, "B*C") == pytest.approx({"D*E": 1})
    assert "A = A + B*D + C*E" in design.text()


def test_signs_of_the_generators_show_in_the_aliases():
    design = FractionalFactorial(generators="D=-AB").generate(space(4))
    assert aliases(design, "D") == pytest.approx({"A*B": -1})


def test_plackett_burman_interactions_leak_by_a_third():
    design = PlackettBurman().generate(space(9))
    found = aliases(design, "A")
    assert len(found) == 28  # all interactions without A
    np.testing.assert_allclose(np.abs(list(found.values())), 1 / 3)
    assert "A = A − 0.33" in design.text() or "A = A + 0.33" in design.text()


def test_d_efficiency_by_its_definition():
    corner = np.array([[-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0]])
    matrix = np.column_stack([np.ones(3), corner])
    assert d_efficiency(corner) == pytest.approx(100 * np.linalg.det(matrix.T @ matrix) ** (1 / 3) / 3)
    assert d_efficiency(np.zeros((5, 2))) == 0.0
    assert FullFactorial().generate(space(4)).d_efficiency("interactions") == pytest.approx(100)


@pytest.mark.parametrize(("runs", "effect", "noise"), [(8, 2.0, 1.0), (12, 1.5, 1.3), (20, 0.7, 0.9)])
def test_power_of_one_factor_is_the_power_of_a_t_test(runs, effect, noise):
    """With one factor the F test is the two-sample t test, whose power statsmodels computes on its own."""
    design = FullFactorial(replicates=runs // 2).generate(FactorSpace([Factor("x", 0, 1)]))
    ours = design.power(effect=effect, noise=noise, model="linear")["power"].iloc[0]
    theirs = TTestIndPower().power(effect / noise, nobs1=runs // 2, alpha=0.05)
    assert ours == pytest.approx(theirs, abs=1e-9)


def test_power_by_simulation():
    design = BoxBehnken().generate(space(3))
    promised = design.power(effect=2.0, noise=1.0).set_index("term")["power"]["A"]
    rng = np.random.default_rng(1)
    from scipy import stats

    from designs.terms import model_matrix, model_terms

    matrix = model_matrix(design.coded.to_numpy(), model_terms(3, "quadratic"))
    y = matrix[:, 1] * 1.0 + rng.normal(size=(4000, len(design)))
    coefficients = y @ np.linalg.pinv(matrix).T
    residual = y - coefficients @ matrix.T
    error = np.sqrt((residual**2).sum(axis=1) / 5 * np.linalg.inv(matrix.T @ matrix)[1, 1])
    seen = np.abs(coefficients[:, 1] / error) > stats.t.ppf(0.975, 5)
    assert seen.mean() == pytest.approx(promised, abs=4 * np.sqrt(promised * (1 - promised) / 4000))


def test_saturated_design_has_no_power_and_says_so():
    design = PlackettBurman(runs=12).generate(FactorSpace(Factor(f"x{i}", 0, 1) for i in range(11)))
    assert design.power(effect=1, noise=1)["power"].isna().all()
    assert "saturated" in design.text()


def test_power_refuses_nonsense():
    with pytest.raises(DesignError, match="noise = 0"):
        FullFactorial().generate(space(2)).power(effect=1, noise=0)


def test_side_by_side_and_csv(tmp_path):
    import pandas as pd

    design = BoxBehnken().generate(space(3), seed=4)
    assert isinstance(design, Design)
    both = design.side_by_side()
    assert list(both.columns[-3:]) == ["coded A", "coded B", "coded C"]
    np.testing.assert_allclose(both["coded A"], 2 * both["A"] - 1)
    written = pd.read_csv(design.to_csv(tmp_path / "runs.csv"))
    pd.testing.assert_frame_equal(written, design.table)
