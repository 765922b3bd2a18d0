"""The text of a study to fill in: study.toml with comments and sources, and the table that waits for measurements."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from taichidem import plugins
from taichidem.experiments.base import Experiment
from taichidem.starting_materials import Sourced, StartingMaterial, starting_contact
from taichidem.study.effect_section import ALWAYS
from taichidem.study.init_settings import decisions, quantity_text
from taichidem.study.parameter_key import SHORT, pair_name

COLUMN = 40  # where comments begin
# Softened so that grains are pressed as deep under their own weight as those of polypropylene, 6 mm and 10 MPa, with which no
# shift of the heap was seen. A softer grain allows larger time steps.
SOFT_MODULUS, SOFT_DENSITY, SOFT_DIAMETER = 1e7, 910.0, 0.006
POISSONS_RATIO = 0.3  # where no source was found


class Sources:
    """Numbers the sources in the order in which they are first needed."""

    def __init__(self) -> None:
        self.found: list[str] = []

    def mark(self, source: str) -> str:
        """Return "[2]" for the second source that was needed."""
        if source not in self.found:
            self.found.append(source)
        return f"[{self.found.index(source) + 1}]"


def study_text(
    experiments: Mapping[str, type[Experiment]], grain: StartingMaterial, wall: StartingMaterial, diameter: float
) -> str:
    """Return study.toml for experiments with grains of a diameter [m] and walls of another material or the same."""
    sources = Sources()
    body = [
        *_particle(grain, diameter),
        *_materials(grain, wall, diameter, sources),
        *_contacts(grain, wall, sources),
        *_effects(),
        *_experiments(experiments, diameter),
    ]
    head = [
        "# A study to fill in: what you believe of your granules, what may be re-calibrated, and your tests.",
        "# Replace what you know better, and write what you measured into measurements.csv.",
        '# A quantity is a number in SI or a text with a unit, such as "6 mm".',
        "#",
        "# Sources of the numbers below:",
        *(f"#   [{k}] {source}" for k, source in enumerate(sources.found, 1)),
        *([f"# {grain.note}"] if grain.note else []),
        "",
        "schema = 1",
        f'title = "{grain.title}, {quantity_text(diameter, "m")[1:-1]}"',
        "",
    ]
    return "\n".join([*head, *body])


def _line(text: str, comment: str = "") -> str:
    return f"{text:<{COLUMN - 1}} # {comment}" if comment else text


def _particle(grain: StartingMaterial, diameter: float) -> Iterator[str]:
    yield "[particle]"
    yield 'shape = "sphere"'
    yield _line(f"diameter = {quantity_text(diameter, 'm')}", "measure it: every size below was chosen to fit it")
    yield "# Grains that are no spheres have the volume of a sphere of that diameter; docs/shapes.md tells how to choose."
    yield '# shape = "spheroid"'
    yield _line("# aspect_ratio = 1.5", "length over width; below 1 they are flat")
    yield f'material = "{grain.name}"'
    yield ""


def _materials(grain: StartingMaterial, wall: StartingMaterial, diameter: float, sources: Sources) -> Iterator[str]:
    yield f"[materials.{grain.name}]"
    yield _line(f"density = {quantity_text(grain.density.value, 'kg/m^3')}", _origin(grain.density, "kg/m^3", sources))
    soft = _soft_modulus(grain, diameter)
    real = grain.youngs_modulus
    reason = "softened for larger time steps; "
    reason += f"the solid has {_origin_text(real, sources)}" if real else "no source for the solid's own"
    yield _line(f"youngs_modulus = {quantity_text(soft, 'Pa')}", reason)
    yield _poissons_ratio(grain, sources)
    yield ""
    if wall.name == grain.name:
        return
    yield _line(f"[materials.{wall.name}]", "of the walls")
    yield _line(f"density = {quantity_text(wall.density.value, 'kg/m^3')}", _origin(wall.density, "kg/m^3", sources))
    if wall.youngs_modulus:
        origin = _origin(wall.youngs_modulus, "Pa", sources)
        yield _line(f"youngs_modulus = {quantity_text(wall.youngs_modulus.value, 'Pa')}", origin)
    else:
        yield _line(f"youngs_modulus = {quantity_text(10 * soft, 'Pa')}", "no source; ten times that of the grains")
    yield _poissons_ratio(wall, sources)
    yield ""


def _soft_modulus(grain: StartingMaterial, diameter: float) -> float:
    """Return a modulus [Pa] that keeps ρ g d/E, and is no stiffer than the solid."""
    soft = SOFT_MODULUS * grain.density.value / SOFT_DENSITY * diameter / SOFT_DIAMETER
    return min(soft, grain.youngs_modulus.value) if grain.youngs_modulus else soft


def _origin_text(number: Sourced, sources: Sources) -> str:
    return f"{quantity_text(number.value, 'Pa')[1:-1]} {sources.mark(number.source)}"


def _poissons_ratio(material: StartingMaterial, sources: Sources) -> str:
    known = material.poissons_ratio
    if known is None:
        return _line(f"poissons_ratio = {POISSONS_RATIO}", "no source; a common value")
    return _line(f"poissons_ratio = {known.value:g}", _origin(known, "1", sources))


def _origin(number: Sourced, unit: str, sources: Sources) -> str:
    """Return the published range, if there is one, and the number of the source."""
    mark = sources.mark(number.source)
    if number.low is None or number.high is None:
        return mark
    return f"{number.low:g} to {number.high:g}{'' if unit == '1' else ' ' + unit} {mark}"


def _contacts(grain: StartingMaterial, wall: StartingMaterial, sources: Sources) -> Iterator[str]:
    ranges = []
    for other in dict.fromkeys((grain.name, wall.name)):
        known = starting_contact(grain, wall if other == wall.name else grain)
        pair = pair_name(grain.name, other)
        yield f"[contacts.{pair}]"
        for short in SHORT:
            number = getattr(known, short)
            low, high = _range(short, number)
            value = number.value if number else float(f"{(low + high) / 2:.2g}")
            comment = _origin(number, "1", sources) if number else "no source; the middle of what is plausible"
            yield _line(f"{short} = {value:g}", comment)
            origin = (
                "as published" if number and number.low is not None else "no published range: all that is plausible"
            )
            ranges.append(_line(f'"{pair}.{short}" = {{ low = {low:g}, high = {high:g} }}', origin))
        yield ""
    yield "# What may be re-calibrated, and the range that you believe. Where you measured one directly, say by sliding on an"
    yield "# incline, add value and standard uncertainty: { low = 0.2, high = 0.8, value = 0.42, u = 0.02 }."
    yield '# A setting of a test that nobody measured may stand here as well, as "TEST.setting".'
    yield "[calibrate]"
    yield from ranges
    yield ""


def _range(short: str, number: Sourced | None) -> tuple[float, float]:
    """Return the range of a contact's parameter: the published one, else what its effect declares plausible."""
    if number and number.low is not None and number.high is not None:
        return number.low, number.high
    effects = [plugins.get("effect", name) for name in ALWAYS]
    return next(p.plausible for e in effects for p in e.parameters if e.family == SHORT[short] and p.name == short)


def _effects() -> Iterator[str]:
    yield "# Every model has Hertz contact, friction and gravity. To believe in more, such as a resistance to rolling, take away"
    yield "# the # below; `taichidem plugins effect` lists all."
    yield "# [effects.rolling_constant_torque]"
    yield "# rolling_friction = 0.05"
    yield ""


def _experiments(experiments: Mapping[str, type[Experiment]], diameter: float) -> Iterator[str]:
    yield "# Your tests. The numbers are the defaults for grains of this size; write those of your apparatus. A second test of"
    yield "# the same type, at another speed say, is a section with a name of its own. docs/experiments.md shows every setting."
    for name, kind in experiments.items():
        yield f"[experiments.{name}]"
        yield f"# {kind.title}{f'; imitates: {kind.imitates}' if kind.imitates else ''}."
        yield f'type = "{kind.name}"'
        for decision in decisions(kind, diameter):
            yield _line(f"{decision.name} = {decision.value}", decision.meaning)
        yield ""


def measurements_text(experiments: Mapping[str, Experiment]) -> str:
    """Return measurements.csv with a row per observable whose value, u and n wait to be filled in."""
    rows: list[tuple[Any, ...]] = [
        (name, o.name, "", "", o.unit, "") for name, experiment in experiments.items() for o in experiment.observables
    ]
    return "\n".join(",".join(row) for row in [("experiment", "observable", "value", "u", "unit", "n"), *rows]) + "\n"
