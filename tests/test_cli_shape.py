"""The form of grains on the command line."""

import pytest
from typer.testing import CliRunner

from taichidem.cli.application import app
from taichidem.cli.shape import parse_shape
from taichidem.errors import InputError
from taichidem.experiments import FixedFunnel
from taichidem.experiments.base import Outcome
from taichidem.shapes import Superquadric


@pytest.mark.parametrize(
    ("text", "shape"),
    [
        (None, None),
        ("sphere", None),
        ("spheroid:1", None),
        ("spheroid:1.5", Superquadric.spheroid(1.5)),
        ("superquadric:1,2,3", Superquadric(1, 2, 3)),
        ("superquadric:1, 1, 1.5, 4, 3", Superquadric(1, 1, 1.5, 4, 3)),
    ],
)
def test_texts_and_forms(text, shape):
    assert parse_shape(text) == shape


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("speroid:1.5", r"Unknown shape 'speroid'.*Did you mean 'spheroid'"),
        ("spheroid", "numbers, 1 of them"),
        ("spheroid:long", "'spheroid:long'"),
        ("superquadric:1,2", "numbers, 3 or 5 of them"),
        ("superquadric:1,2,-3", "semi-axis"),
        ("sphere:2", "numbers, 0 of them"),
    ],
)
def test_other_texts_are_refused(text, said):
    with pytest.raises(InputError, match=said):
        parse_shape(text)


def test_simulate_takes_the_form(monkeypatch):
    seen = []

    def quickly(self, models, seeds, **_):
        seen.append(models)
        return [Outcome({"angle_of_repose": 20.0}, seed) for seed in seeds]

    monkeypatch.setattr(FixedFunnel, "run", quickly)
    shown = CliRunner().invoke(app, ["simulate", "fixed_funnel", "--shape", "spheroid:1.5", "--json"])
    assert shown.exit_code == 0, shown.output
    assert seen[0].shape == Superquadric.spheroid(1.5)
