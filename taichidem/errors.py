"""The errors taichidem raises, each saying what was given, what is allowed and what to do."""

from __future__ import annotations

import difflib
from collections.abc import Iterable


class TaichidemError(Exception):
    """Base of every error that taichidem raises on purpose."""


class InputError(TaichidemError, ValueError):
    """A value, name or file given by the user can't be used."""


class CompositionError(TaichidemError, ValueError):
    """Effects, shapes or walls that can't work together."""


class SimulationError(TaichidemError, RuntimeError):
    """A world stopped for a reason of its own (diverged, overflowed, overlapped too far)."""


class EnvironmentProblem(TaichidemError, RuntimeError):  # noqa: N818 - the machine's problem, not the program's
    """The machine lacks something; the message names the command that cures it."""


class CheckpointWarning(UserWarning):
    """A checkpoint could not be written; the run goes on without it."""


def nearest(given: str, allowed: Iterable[str]) -> str | None:
    """Return the allowed name that was likely meant, or None."""
    near = difflib.get_close_matches(given, sorted(allowed), n=1, cutoff=0.4)
    return near[0] if near else None


def unknown_name(kind: str, given: str, allowed: Iterable[str]) -> InputError:
    """Return the error for an unknown name, with the allowed ones and the nearest."""
    names = sorted(allowed)
    near = nearest(given, names)
    hint = f" Did you mean {near!r}?" if near else ""
    return InputError(f"Unknown {kind} {given!r}. Allowed: {', '.join(names) or 'none'}.{hint}")
