"""The files that `taichidem simulate` draws to: checked before anything runs, written at the end."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from taichidem.errors import InputError
from taichidem.units import to_si


@dataclass(frozen=True)
class Drawn:
    """What is to be drawn of a single experiment.

    Args:
        picture: file of the picture, or None.
        movie: file of the movie, or None.
        frame_interval: time between frames as typed, such as "1 ms"; the experiment's own where None.
        colour_by: name of what colours the grains; their speed, or height at rest, where None.
    """

    picture: Path | None = None
    movie: Path | None = None
    frame_interval: str | None = None
    colour_by: str | None = None

    def options(self) -> dict[str, Any]:
        """Return the options of the command line and what they were given."""
        return {"--picture": self.picture, "--movie": self.movie, **self._details()}

    def _details(self) -> dict[str, str | None]:
        return {"--frame-interval": self.frame_interval, "--colour-by": self.colour_by}

    def check(self) -> None:
        """Raise InputError unless every file asked for can be written, in the colours asked for."""
        from taichidem.render_colours import quantity_named

        for option, given in self._details().items():
            if given is not None and not (self.picture or self.movie):
                raise InputError(
                    f"{option} is of use with --picture or --movie alone. Give one of these, or leave it out."
                )
        if self.colour_by is not None:
            quantity_named(self.colour_by)
        for option, path, ending in (("--picture", self.picture, ".png"), ("--movie", self.movie, ".gif")):
            if path is not None:
                _check_file(option, path, ending)

    def interval(self, experiment: Any) -> float | None:
        """Return the time between frames [s], None where nothing is drawn."""
        if not (self.picture or self.movie):
            return None
        if self.frame_interval is None:
            return float(experiment.frame_interval)
        seconds = to_si(self.frame_interval, "s", "--frame-interval")
        if seconds <= 0:
            raise InputError(f"--frame-interval is {self.frame_interval!r}; give a time above 0, such as '0.05 s'.")
        return seconds

    def draw(self, experiment: Any, model: Any, outcome: Any) -> None:
        """Write the files."""
        if not (self.picture or self.movie):
            return
        from taichidem import render_experiment

        if self.picture is not None:
            render_experiment.picture(experiment, model, outcome, self.picture, colour_by=self.colour_by)
        if self.movie is not None:
            render_experiment.movie(experiment, model, outcome, self.movie, colour_by=self.colour_by)


def _check_file(option: str, path: Path, ending: str) -> None:
    if path.suffix.lower() != ending:
        raise InputError(
            f"{option} is {str(path)!r}; it is written as {ending[1:].upper()}. Give a name that ends in {ending}."
        )
    there = path.exists()
    try:
        path.open("ab").close()
    except OSError as problem:
        raise InputError(
            f"{option} {path}: can't be written ({problem.strerror}). Give a file in a folder that exists and may be written to."
        ) from problem
    if not there:
        path.unlink()
