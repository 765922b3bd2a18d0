"""The benchmark of a pass writes the tests it means, for a LIGGGHTS that need not be there, and adds up what it measured."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest
import pyvista

from benchmarks import bench_pass
from benchmarks.bench_pass import Row, shortened, table
from benchmarks.pass_decks import Case, deck
from benchmarks.pass_liggghts import PeerTiming, loops, observe
from benchmarks.pass_ours import Timing, seen
from taichidem.effects import BodyGravity, NormalHertz, RollingConstantTorque, TangentialMindlin
from taichidem.errors import InputError
from taichidem.experiments import BulkDensity, FixedFunnel, HopperDischarge, Ledge, Rebound, RotatingDrum
from taichidem.materials import Material
from taichidem.scene import Model

MATERIALS = (
    Material("granule", density=910.0, youngs_modulus=5e6, poissons_ratio=0.36),
    Material("wall", density=7800.0, youngs_modulus=50e6, poissons_ratio=0.3),
)
EFFECTS = (
    NormalHertz(restitution={"granule-granule": 0.6, "granule-wall": 0.7}),
    TangentialMindlin(static_friction={"granule-granule": 0.4, "granule-wall": 0.3}),
    BodyGravity(x=0.0, y=0.0, z=-9.81),
)
MODEL = Model(MATERIALS, EFFECTS)


def script(test, tmp_path) -> list[str]:
    return deck(Case(test, MODEL, 1), tmp_path).splitlines()


def durations(lines: list[str]) -> list[float]:
    """Return what each run of a script lasts [s]."""
    step = float(next(line for line in lines if line.startswith("timestep")).split()[1])
    return [int(line.split()[1]) * step for line in lines if line.startswith("run ")]


def test_a_script_holds_the_model_and_the_rained_grains(tmp_path):
    lines = script(Ledge(particles=50), tmp_path)
    assert "fix modulus all property/global youngsModulus peratomtype 5000000 50000000" in lines
    restitution = next(line for line in lines if "coefficientRestitution" in line).split("2 ", 1)[1]
    friction = next(line for line in lines if "coefficientFriction" in line).split("2 ", 1)[1]
    assert [float(v) for v in restitution.split()] == [0.6, 0.7, 0.7, 0.7]
    assert [float(v) for v in friction.split()] == [0.4, 0.3, 0.3, 0.3]
    assert "velocity all set 0 0 -0.29999999999999999" in lines
    rows = np.loadtxt((tmp_path / "rain.data").read_text().split("Atoms")[1].splitlines()[1:])
    assert rows.shape == (50, 7)
    assert np.all(rows[:, 2] == 0.006)
    assert np.all((rows[:, 4] > 0.006) & (rows[:, 4] < 0.114))


def test_the_ledge_loses_its_front_wall_after_settling(tmp_path):
    lines = script(Ledge(particles=50, settle_time=0.3, flow_time=0.7), tmp_path)
    assert any(line.startswith("fix front all wall/gran") and line.endswith("xplane 0.12") for line in lines)
    runs = [k for k, line in enumerate(lines) if line.startswith("run ")]
    assert runs[0] < lines.index("unfix front") < runs[1]
    assert durations(lines) == pytest.approx([0.3, 0.7, 0.0], abs=1e-4)
    assert pyvista.STLReader(str(tmp_path / "floor.stl")).read().bounds[1] == pytest.approx(0.12)


def test_the_drum_is_closed_and_turns_at_its_speed(tmp_path):
    lines = script(RotatingDrum(particles=50, speed="20 rpm"), tmp_path)
    turns = [line for line in lines if "move/mesh" in line]
    assert len(turns) == 3
    assert all("origin 0.0 0.0 0.0 axis 0.0 1.0 0.0 period" in line for line in turns)
    assert [float(line.split()[-1]) for line in turns] == pytest.approx([3.0] * 3)
    area = sum(pyvista.STLReader(str(tmp_path / f"{n}.stl")).read().area for n in ("drum", "near_end", "far_end"))
    assert area == pytest.approx(2 * math.pi * 0.072 * (0.036 + 0.072), rel=3e-3)
    assert any(line.startswith("dump frames all custom") for line in lines)


def test_hopper_cup_and_funnel_are_the_tests_they_should_be(tmp_path):
    lines = script(HopperDischarge(particles=50), tmp_path)
    assert "variable k loop 300" in lines
    assert lines.index("unfix slide") < lines.index("label flow")
    assert "fix slide all wall/gran model hertz tangential history primitive type 2 zplane 0" in lines
    lines = script(BulkDensity(particles=50), tmp_path)
    assert any(line.endswith("zcylinder 0.035999999999999997 0.0 0.0") for line in lines)
    lines = script(FixedFunnel(particles=90), tmp_path)
    assert any("nparticles 90 particlerate 400" in line for line in lines)
    assert durations(lines)[:2] == pytest.approx([4 * 0.06, 1.3], abs=1e-4)  # 24 grains a batch


def test_laws_that_liggghts_would_not_be_given_are_refused(tmp_path):
    model = Model(MATERIALS, [*EFFECTS, RollingConstantTorque(rolling_friction=0.1)])
    with pytest.raises(InputError, match="rolling_constant_torque"):
        deck(Case(Ledge(particles=50), model, 1), tmp_path)


def test_what_liggghts_leaves_behind_is_measured_as_ours(tmp_path):
    case = Case(HopperDischarge(particles=50), MODEL, 1)
    dump = "ITEM: TIMESTEP\n5\nITEM: ATOMS id x y z \n1 0 0 0.1 \n2 0 0 0.2 \n"
    (tmp_path / "last.dump").write_text(dump)
    printed = "".join(f"look {0.9 + 0.01 * k:.4f} {100 - k}\n" for k in range(101))
    mass = 910 * math.pi / 6 * 0.006**3
    assert observe(case, printed, tmp_path)["mass_flow_rate"] == pytest.approx(1e3 * mass / 0.01)
    said = "Loop time of 1.5 on 1 procs for 100 steps with 8 atoms\n" * 2
    assert loops(said) == (3.0, 200)


def test_the_table_adds_up_and_compares_like_with_like():
    one, two = Timing(4.0, 4.0, 3.0, 10, 8e6, ({},), ()), Timing(5.0, 10.0, 4.0, 10, 1.6e7, ({}, {}), ())
    rows = [Row("heap", 9, one, two, PeerTiming(8.0, 10, {})), Row("rebound", 1, one, two, None)]
    heap, rebound, both, compared = (re.split(r"\s{2,}", line.strip()) for line in table(rows).splitlines()[1:])
    assert heap[2:] == ["10", "8.00", "4.00", "2.00", "25.0 %", "5.00", "1.25", "8.00", "10", "0.50"]
    assert rebound[-3:] == ["–", "–", "–"]
    assert both[1:] == ["20", "16.00", "8.00", "2.00", "25.0 %", "10.00", "1.25", "–", "–", "–"]
    assert compared[-1] == "0.50"
    text = bench_pass.as_text(rows, 1.0, "LIGGGHTS", (0.0, 0.0))
    assert "One seed on one thread: 8.0 s, in which it computed for 8.0 s." in text
    assert "Two seeds on two threads: 10.0 s, 1.25 times that; the aim of 1.15 is missed." in text
    assert "They computed for 10.0 s each;" in text


def test_counts_of_grains_are_compared_too():
    assert seen({"angle": 1.0}, {"grains_in_box": 7, "other": 3}) == {"angle": 1.0, "grains_in_box": 7.0}


def test_a_quick_pass_is_short_and_a_failed_test_is_no_time():
    quick = shortened(RotatingDrum(settle_time=0.6)).settings
    assert (quick.settle_time, quick.spin_up_time, quick.averaging_time) == (0.02, 0.02, 0.05)
    assert shortened(FixedFunnel()).settings.particles == 48
    assert shortened(Rebound(speed=2.0)).settings.speed == 2.0
    with pytest.raises(RuntimeError, match="diverged"):
        bench_pass.checked("heap", Timing(1.0, 1.0, 1.0, 1, 1.0, ({},), ("diverged",)))
