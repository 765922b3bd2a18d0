"""Every registered effect as a hypothesis about what a study's model lacks."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace

from taichidem import plugins
from taichidem.effects.base import Effect, Parameter
from taichidem.effects.probe import ProbeScale
from taichidem.errors import TaichidemError, unknown_name
from taichidem.experiments.base import GRAVITY, Experiment, gravity_of
from taichidem.scene import Model
from taichidem.study.effect_section import ALWAYS
from taichidem.study.study_file import Study


@dataclass(frozen=True)
class Hypothesis:
    """That a model lacks one effect.

    Attributes:
        effect: its class.
        scale: what its strength is measured against.
    """

    effect: type[Effect]
    scale: ProbeScale

    @property
    def name(self) -> str:
        """Name of the effect."""
        return self.effect.name

    @property
    def parameter(self) -> Parameter:
        """The parameter that measures its strength."""
        first = self.effect.growing(self.scale)[0]
        return next(p for p in self.effect.parameters if p.name == first)

    def joined(self, model: Model, share: float) -> Model:
        """Return a model with the effect at a share of its strongest setting; one of its family gives way.

        Raises:
            TaichidemError: the effect can't act in this model.
        """
        added = self.at(share, model)
        kept = [e for e in model.effects if not e.family or e.family != added.family]
        return replace(model, effects=[*kept, added])

    def strength(self, share: float, model: Model) -> float:
        """Return the value of the measuring parameter at a share, that of two grains where it is one per pair.

        An effect whose other side is told by something else than this parameter, such as a direction, gets it with a minus.
        """
        value = self._value(share, model)
        mirrored = share < 0 and value == self._value(-share, model)
        return 2 * float(self.parameter.vanishing or 0.0) - value if mirrored else value

    def _value(self, share: float, model: Model) -> float:
        held = self.at(share, model).values[self.parameter.name]
        return held[self.scale.grain_pair] if isinstance(held, Mapping) else held

    def possible(self, share: float, model: Model) -> float:
        """Return a share, cut to the strongest setting where beyond it a parameter would leave its bounds."""
        try:
            self.at(share, model)
        except TaichidemError:
            return max(-1.0, min(1.0, share))
        return share

    def at(self, share: float, model: Model) -> Effect:
        """Return the effect at a share of its strongest setting, as it would join a model."""
        return self.effect.at_strength(share, self.scale, model.effects)


@dataclass(frozen=True)
class Hypotheses:
    """What can be tested, and what can't with the reason."""

    tested: tuple[Hypothesis, ...]
    not_tested: Mapping[str, str] = field(default_factory=dict)

    def __getitem__(self, name: str) -> Hypothesis:
        return next(h for h in self.tested if h.name == name)


def probe_scale(study: Study) -> ProbeScale:
    """Return the grain and the pace of a study's tests."""
    model, tests = study.model(), [study.experiment(name) for name in study.experiments]
    speeds = [test.typical_speed(model) for test in tests]
    masses = [mass for test in tests if (mass := getattr(test.settings, "mass", None)) is not None]
    diameters = [_diameter(test, study) for test in tests]
    return ProbeScale(
        radius=max(diameters) / 2,
        materials=model.materials,
        gravity=gravity_of(model) or GRAVITY,
        speed=max(speeds),
        mass=max(masses, default=None),
    )


def _diameter(test: Experiment, study: Study) -> float:
    return float(getattr(test.settings, "diameter", study.particle.diameter))


def hypotheses(study: Study, only: Iterable[str] | None = None) -> Hypotheses:
    """Return every registered effect that a study's model lacks, as far as it can be put to the test.

    Args:
        study: whose model is asked.
        only: names of effects; all by default.

    Raises:
        InputError: a name among `only` that is no effect.
    """
    registered = plugins.names("effect")
    wanted = registered if only is None else list(dict.fromkeys(only))
    for name in wanted:
        if name not in registered:
            raise unknown_name("effect", name, registered)
    scale = probe_scale(study)
    tested, not_tested = [], {}
    for name in wanted:
        hypothesis = Hypothesis(plugins.get("effect", name), scale)
        reason = why_not(hypothesis, study)
        if reason is None:
            tested.append(hypothesis)
        elif reason or only is not None:  # what was asked for by name is told
            not_tested[name] = reason or "the model has it already."
    return Hypotheses(tuple(tested), not_tested)


def why_not(hypothesis: Hypothesis, study: Study) -> str | None:
    """Return why an effect can't be tested on a study, "" where its model has it, None where it can."""
    model = study.model()
    present = {e.name: e.family for e in model.effects}
    family = hypothesis.effect.family
    if hypothesis.name in present:
        return ""
    rival = next((name for name, held in present.items() if family and held == family), None)
    if rival is not None and rival not in ALWAYS:
        return f"the model has {rival}, of the same family {family!r}; a model holds one."
    if family and family == plugins.get("effect", "body_gravity").family:
        return "it is another gravity, no effect on grains."
    if not hypothesis.effect.growing(hypothesis.scale):
        return "it declares no parameter with a vanishing value, so that it can't be put in by degrees."
    try:
        joined = hypothesis.joined(model, 1.0)
        for name in study.experiments:
            study.experiment(name).scene(joined)
    except TaichidemError as error:
        return str(error)
    return None
