"""What a bulk test declares: settings with units, what it measures, a scene, a procedure and a measurement."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from pydantic import BaseModel, ConfigDict, ValidationError

from taichidem.checkpoints.keeper import EVERY
from taichidem.effects import BodyGravity
from taichidem.errors import InputError, TaichidemError, unknown_name
from taichidem.grain import Grain
from taichidem.procedure import Frame, Procedure, World
from taichidem.scene import Model, Scene
from taichidem.simulation import Snapshot
from taichidem.units import Length, quantity
from taichidem.walls import Wall


class Settings(BaseModel):
    """Base of an experiment's settings: frozen, SI inside, texts with units accepted, unknown names refused."""

    model_config = ConfigDict(frozen=True, extra="forbid")


class GranularSettings(Settings):
    """What every test with grains lets one choose: their size, and which materials of the model are used."""

    diameter: Length = quantity("m", "Diameter of the grains.", 0.006, coarse_graining=1, gt=0)
    grain_material: str = quantity("1", "Name of the grains' material; the model's first where empty.", "")
    wall_material: str = quantity("1", "Name of the walls' material; the model's last where empty.", "")


@dataclass(frozen=True)
class Observable:
    """A quantity that an experiment measures.

    Attributes:
        name: under which outcomes hold it.
        unit: of its values.
        meaning: a sentence.
        series: what it is one value of where an experiment reads the same quantity several times, such as height.
        at: the setting that tells these values apart and what it is for this one, such as ("time", 0.5).
    """

    name: str
    unit: str
    meaning: str
    series: str = ""
    at: tuple[str, float] | None = None


@dataclass(frozen=True)
class Outcome:
    """What one world of an experiment gave.

    Attributes:
        observables: name → value, in the units the experiment declares; empty when the world failed.
        seed: of this world's random stream.
        failure: why the world stopped, or None.
        snapshot: its grains at the end, or None when it failed.
        details: further numbers and reports of the measurement.
        frames: what one would have seen, at the intervals asked for and at the end.
        stopped: whether the engine stopped the world for a numerical cause: it diverged, overlapped too far, or ran out of
            room in a list. Other random numbers may fare better.
    """

    observables: Mapping[str, float]
    seed: int
    failure: str | None = None
    snapshot: Snapshot | None = None
    details: Mapping[str, Any] = field(default_factory=dict)
    frames: tuple[Frame, ...] = ()
    stopped: bool = False


GRAVITY = 9.81  # [m/s²] where a model has none


def gravity_of(model: Model) -> float:
    """Return the size of the acceleration of free fall in a model [m/s²]."""
    fields = [[e.value(axis) for axis in "xyz"] for e in model.effects if isinstance(e, BodyGravity)]
    return float(np.linalg.norm(fields)) if fields else 0.0


class Experiment:
    """Base of bulk tests; a subclass is one file."""

    name: ClassVar[str] = ""
    title: ClassVar[str] = ""
    imitates: ClassVar[str] = ""  # the real instrument or standard
    observables: tuple[Observable, ...] = ()  # of an instance where they depend on its settings
    settings_type: ClassVar[type[Settings]] = Settings
    random: ClassVar[bool] = True  # whether seeds differ; where not, one run knows the result without scatter
    view: ClassVar[tuple[float, float]] = (-60.0, 18.0)  # azimuth and elevation [deg] from which a picture is taken
    shown_at: ClassVar[float] = 1.0  # share of the test's frames at which a single picture tells most
    frame_interval: ClassVar[float] = (
        0.05  # [s] between the frames of a picture or movie, where nothing else is asked for
    )

    def __init__(self, **settings: Any) -> None:
        known = self.settings_type.model_fields
        for name in settings:
            if name not in known:
                raise unknown_name(f"setting of {self.name}", name, known)
        try:
            self.settings: Any = self.settings_type(**settings)
        except ValidationError as error:
            raise InputError(_explain(self, error)) from None

    @classmethod
    def proposed(cls, diameter: float) -> tuple[dict[str, Any], dict[str, float]]:
        """Return settings for grains of a diameter [m], and what each observable would be uncertain by, if it was measured.

        Tests that cost little to simulate and to make in a laboratory propose themselves, as what one might measure next to
        tell rival explanations apart. By default a test does not: both are empty.
        """
        return {}, {}

    def typical_speed(self, model: Model) -> float:
        """Return at what speed things move [m/s], to its order: by default that of a fall through ten diameters."""
        return float(np.sqrt(2 * (gravity_of(model) or GRAVITY) * 10 * self.settings.diameter))

    def grain(self, model: Model) -> Grain:
        """Return the grains of the test, in the form of the model's and the sizes that its set-up effects ask for."""
        number = model.material_number(self.settings.grain_material or model.materials[0].name)
        sizes, changes, shape = model.relative_sizes(), model.set_up_effects, model.grain_shape
        return Grain(self.settings.diameter / 2, model.materials[number], number, sizes, changes, shape)

    def wall_material(self, model: Model) -> str:
        """Return the name of the walls' material."""
        return self.settings.wall_material or model.materials[-1].name

    def particles_needed(self) -> int:
        """Return how many grains a run costs; those of the setting `particles`, or one."""
        return getattr(self.settings, "particles", 1)

    def walls(self, model: Model) -> tuple[Wall, ...]:
        """Return the apparatus as it stands at the start; none by default."""
        return ()

    def scene(self, model: Model) -> Scene:
        """Return the apparatus with room for the grains."""
        raise NotImplementedError(f"{type(self).__name__} must define scene")

    def scene_within(self, model: Model, lower: Sequence[float], upper: Sequence[float], **options: Any) -> Scene:
        """Return the walls with room for the grains, in a domain between two corners [m]; `options` go to `Scene`."""
        grain = self.grain(model)
        return Scene(
            model=model,
            walls=self.walls(model),
            room=self.particles_needed(),
            domain=(lower, upper),
            grains_like=grain.sample(),
            grain_materials=(grain.material.name,),
            **options,
        )

    def procedure(self, world: World, model: Model) -> Procedure:
        """Yield the durations [s] that pass between the acts of the test."""
        raise NotImplementedError(f"{type(self).__name__} must define procedure")

    def measure(self, snapshot: Snapshot, record: Mapping[str, list]) -> tuple[dict[str, float], dict[str, Any]]:
        """Return the observables and further details, from the end state and from what the procedure noted."""
        raise NotImplementedError(f"{type(self).__name__} must define measure")

    def observable_at(self, name: str, conditions: Mapping[str, str]) -> str:
        """Return which observable a measurement is; `name` itself, unless the conditions it was made under tell more.

        Args:
            name: as a table of measurements gives it.
            conditions: the table's further columns in that row, as texts.

        Raises:
            InputError: conditions under which the experiment measures nothing.
        """
        return name

    def parts(self) -> Sequence[Experiment]:
        """Return what is run side by side for one outcome: this experiment alone, unless it repeats itself under other loads."""
        return (self,)

    def combine(self, outcomes: Sequence[Outcome]) -> Outcome:
        """Return one outcome from those of the parts."""
        return outcomes[0]

    def run(
        self,
        models: Model | Sequence[Model],
        seeds: Sequence[int],
        *,
        schedule: str = "worlds",
        report: Callable[[float], None] | None = None,
        frames: float | None = None,
        checkpoint: str | Path | None = None,
        checkpoint_every: float = EVERY,
    ) -> list[Outcome]:
        """Run one world per seed (and per model, where several are given: then one seed each) and measure them all.

        Args:
            schedule: "worlds" or "particles", as for `Simulation`.
            report: called with the share done.
            frames: interval [s] at which frames are kept for a movie; the end alone where left out.
            checkpoint: file into which the state is written on the way. Where it is there already, the run goes on from
                it. At the end it stands at the end, and the same call only measures again: delete it once the outcomes are
                kept elsewhere. One that can't be written on the way is told by a `CheckpointWarning`.
            checkpoint_every: wall time between two checkpoints [s].

        Raises:
            InputError: numbers of models and seeds that do not fit together, or a checkpoint of another run.
        """
        models = [models] * len(seeds) if isinstance(models, Model) else list(models)
        if not seeds or len(models) != len(seeds):
            raise InputError(
                f"{len(models)} models and {len(seeds)} seeds were given; give one seed per model, at least one."
            )
        if not all(isinstance(seed, (int, np.integer)) and seed >= 0 for seed in seeds):
            raise InputError(f"seeds are {list(seeds)!r}; give whole numbers from 0.")
        from taichidem.experiments.together import run_together

        options: dict[str, Any] = {"schedule": schedule, "report": report, "frames": frames}
        options |= {"checkpoint": checkpoint, "checkpoint_every": checkpoint_every}
        return run_together([self] * len(seeds), models, seeds, **options)

    def outcome(self, world: World, seed: int) -> Outcome:
        """Return what a world gave whose procedure has ended."""
        frames, stopped = tuple(world.frames), world.simulation.failure(world.number)
        if world.failure:
            return Outcome({}, seed, world.failure, frames=frames)
        if stopped:  # the same run has another number in another batch, so its reason tells none
            return Outcome({}, seed, stopped.replace(f"World {world.number}", "It", 1), frames=frames, stopped=True)
        end = world.seen()
        snapshot, frames = end.snapshot, (*frames, end)
        try:
            observables, details = self.measure(snapshot, world.record)
        except (TaichidemError, ValueError) as error:
            return Outcome({}, seed, f"The end state can't be measured: {error}", snapshot, frames=frames)
        return Outcome(observables, seed, None, snapshot, details, frames)


def _explain(experiment: Experiment, error: ValidationError) -> str:
    lines = []
    for problem in error.errors():
        name = ".".join(str(part) for part in problem["loc"]) or "settings"
        declared = experiment.settings_type.model_fields.get(name)
        unit = (declared.json_schema_extra or {}).get("unit", "1") if declared else "1"  # type: ignore[union-attr]
        cause = problem["msg"].removeprefix("Value error, ")
        lines.append(f"{experiment.name}.{name} is {problem['input']!r} [{unit}]: {cause.rstrip('.')}.")
    return " ".join(lines)
