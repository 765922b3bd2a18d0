"""The commands design and analyse, as a newcomer uses them."""

from __future__ import annotations

import json
import os

import numpy as np
import pandas as pd
import pytest
import typer
from typer.testing import CliRunner

from designs import BUILT_IN
from taichidem import plugins
from taichidem.cli.designs import parse_value, read_table, register
from taichidem.errors import InputError
from taichidem.paper.published import DATA, central_composite

FACTORS = """
[factors.friction]
low = 0.1
high = 0.6
[factors.restitution]
low = 0.3
high = 0.97
highest = 1
[factors.density]
low = 889
high = 1107
unit = "kg/m³"
"""


@pytest.fixture
def cli(tmp_path, monkeypatch):
    """Run a command in an empty folder that holds factors.toml; return the result."""
    app = typer.Typer()
    register(app)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "factors.toml").write_text(FACTORS, encoding="utf-8")
    return lambda *words: CliRunner().invoke(app, [str(word) for word in words])


def refused(result, *words):
    assert result.exit_code == 2, result.output
    assert "Error:" in result.output
    assert "Traceback" not in result.output
    for word in words:
        assert word in result.output


def test_lists(cli):
    designs, analysers = cli("design"), cli("analyse")
    for name in plugins.names("design"):
        assert name in designs.stdout
    for name in plugins.names("analyser"):
        assert name in analysers.stdout


@pytest.mark.parametrize("name", sorted(BUILT_IN))
def test_every_design_through_the_command(cli, tmp_path, name):
    result = cli("design", name, "--factors", "factors.toml", "-o", "runs.csv", "--seed", 3,
                 *(["--set", "kind=face_centred"] if name == "central_composite" else []))  # fmt: skip
    assert result.exit_code == 0, result.output
    table = pd.read_csv(tmp_path / "runs.csv")
    assert list(table.columns[:6]) == ["run", "std_order", "run_order", "block", "point_type", "seed"]
    assert list(table.columns[6:]) == ["friction", "restitution", "density"]
    assert f"Wrote {len(table)} runs" in result.stdout
    assert "Alias structure" in result.stdout


@pytest.mark.parametrize("name", plugins.names("analyser"))
def test_every_analyser_explains_itself(cli, name):
    result = cli("analyse", name, "--describe")
    assert result.exit_code == 0, result.output
    assert name in result.stdout


def test_round_trip_through_a_spreadsheet(cli, tmp_path):
    """Design, fill in a column, analyse, with the design as a check and the factors' own coding."""
    cli("design", "box_behnken", "-f", "factors.toml", "-o", "runs.csv", "--coded")
    table = pd.read_csv(tmp_path / "runs.csv")
    table["aor_deg"] = 20 + 20 * table["friction"] - 5 * table["restitution"] + np.sin(np.arange(len(table)))
    table.to_csv(tmp_path / "results.csv", index=False)
    words = ("analyse", "response_surface", "results.csv", "--response", "aor_deg", "--design", "runs.csv")
    result = cli(*words, "--factors", "factors.toml", "-o", "out")
    assert result.exit_code == 0, result.output
    assert "friction" in result.stdout
    names = {path.name for path in (tmp_path / "out").iterdir()}
    assert {"anova.csv", "coefficients.csv", "report.json", "report.txt", "pareto.png", "residuals.png"} <= names
    assert json.loads((tmp_path / "out" / "report.json").read_text(encoding="utf-8"))["numbers"]["R2 %"] > 80
    guessed = cli("analyse", "model_summary", "results.csv", "-r", "aor_deg", "-s", "model=linear")
    assert "coded" not in guessed.stdout.split("Coefficients")[1]


def test_spreadsheet_with_semicolons_and_decimal_commas(cli, tmp_path):
    table = central_composite()
    table.to_csv(tmp_path / "european.csv", sep=";", decimal=",", index=False, encoding="utf-8-sig")
    result = cli("analyse", "optimise", "european.csv", "-r", "aor_deg", "-s", "hierarchy=none")
    assert result.exit_code == 0, result.output
    assert "F = 0.5211, D = 0.5485" in result.stdout


def test_the_papers_table_7_on_the_command_line(cli):
    result = cli("analyse", "main_effects", DATA / "table3_plackett_burman.csv", "--response", "aor_deg")
    assert result.exit_code == 0, result.output
    assert "11.428" in result.stdout


def test_factors_narrow(cli):
    path = DATA / "table3_plackett_burman.csv"
    names = "F_static_friction_pp_pp,D_restitution_pp_pp"
    result = cli("analyse", "anova", path, "-r", "aor_deg", "-f", names, "-s", "model=interactions")
    assert result.exit_code == 0, result.output
    assert "B_density_pp" not in result.stdout


def test_several_responses_and_goals(cli, tmp_path):
    table = central_composite().assign(cost=lambda t: t["F"] * 10)
    table.to_csv(tmp_path / "two.csv", index=False)
    goals = "goals=aor_deg:target=28:low=26:high=30,cost:minimise"
    result = cli("analyse", "optimise", "two.csv", "-r", "aor_deg,cost", "-s", goals, "-s", "model=quadratic")
    assert result.exit_code == 0, result.output
    assert "Overall desirability" in result.stdout


def test_augmentation(cli, tmp_path):
    cli("design", "plackett_burman", "-f", "factors.toml", "-o", "first.csv")
    result = cli(
        "design", "d_optimal", "-f", "factors.toml", "--existing", "first.csv", "--runs", 18, "-o", "second.csv"
    )
    assert result.exit_code == 0, result.output
    first, second = pd.read_csv(tmp_path / "first.csv"), pd.read_csv(tmp_path / "second.csv")
    assert len(second) == 18
    assert list(second["seed"][:12]) == list(first["seed"])


def test_power(cli):
    result = cli("design", "plackett_burman", "-f", "factors.toml", "--effect", 5, "--noise", 1.8)
    assert "Power for an effect of 5 with noise 1.8 at α = 0.05: 99 %" in result.stdout
    assert "density" in result.stdout  # without -o the runs are shown
    refused(cli("design", "plackett_burman", "-f", "factors.toml", "--effect", 5), "--noise")


def test_settings_from_text():
    assert parse_value("4,2") == (4, 2)
    assert parse_value("1.5") == 1.5
    assert parse_value("yes") is True
    assert parse_value("none") is None
    assert parse_value("none", "each_step") == "none"
    assert parse_value("D=ABC, E=-AB") == "D=ABC, E=-AB"


def test_clear_errors_of_design(cli, tmp_path):
    refused(cli("design", "box_benken", "-f", "factors.toml"), "Did you mean 'box_behnken'")
    refused(cli("design", "box_behnken"), "--factors factors.toml", "low = 0.1")
    refused(cli("design", "box_behnken", "-f", "no.toml"), "There is no file no.toml")
    refused(cli("design", "central_composite", "-f", "factors.toml"), "physical bounds", "face_centred")
    refused(cli("design", "plackett_burman", "-f", "factors.toml", "--runs", 22), "20 or 24")
    refused(cli("design", "sobol", "-f", "factors.toml", "-s", "scrambled=no"), "Did you mean 'scramble'")
    refused(cli("design", "sobol", "-f", "factors.toml", "-s", "scramble"), "name=value")
    refused(cli("design", "sobol", "-f", "factors.toml", "--existing", "factors.toml"), "")
    refused(cli("design", "sobol", "-f", "factors.toml", "-o", "no/such/folder/runs.csv"), "can't be written")
    (tmp_path / "twice.toml").write_text("[factors.A]\nlow=0\nhigh=1\n[factors.a]\nlow=0\nhigh=1\n")
    refused(cli("design", "sobol", "-f", "twice.toml"), "given twice")


def test_a_table_of_runs_is_whole_or_as_it_was(cli, tmp_path, monkeypatch):
    def full(number):
        raise OSError(28, "No space left on device")

    words = ("design", "box_behnken", "-f", "factors.toml", "-o", "runs.csv")
    assert cli(*words).exit_code == 0
    before = (tmp_path / "runs.csv").read_bytes()
    monkeypatch.setattr(os, "fsync", full)
    refused(cli(*words, "--seed", 5), "runs.csv can't be written: No space left on device")
    assert (tmp_path / "runs.csv").read_bytes() == before
    assert {path.name for path in tmp_path.iterdir()} == {"factors.toml", "runs.csv"}


def test_clear_errors_of_analyse(cli, tmp_path):
    path = DATA / "table3_plackett_burman.csv"
    refused(cli("analyse", "main_effect", path), "Did you mean 'main_effects'")
    refused(cli("analyse", "main_effects"), "TABLE.csv")
    refused(cli("analyse", "main_effects", "no.csv", "-r", "y"), "There is no file no.csv")
    refused(cli("analyse", "main_effects", path), "exactly 1 response")
    refused(cli("analyse", "main_effects", path, "-r", "aor"), "Did you mean 'aor_deg'")
    refused(cli("analyse", "anova", path, "-r", "aor_deg", "-s", "model=interactions"), "smaller model")
    refused(cli("analyse", "anova", path, "-r", "aor_deg", "-f", "F"), "'F'")
    (tmp_path / "empty.csv").write_text("")
    refused(cli("analyse", "anova", "empty.csv", "-r", "y"), "no CSV table")
    cli("design", "box_behnken", "-f", "factors.toml", "-o", "runs.csv")
    refused(cli("analyse", "anova", path, "-r", "aor_deg", "--design", "runs.csv"), "doesn't match the design")


def test_a_table_with_two_columns_of_one_name_is_refused(tmp_path):
    path = tmp_path / "twice.csv"
    path.write_text("run,a,a,y\n1,0,0,1\n2,1,1,2\n")
    with pytest.raises(InputError, match="more than one column named a"):
        read_table(path)
