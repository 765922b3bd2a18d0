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


def unknown_name(kind: str, given: str, allowed: Iterable[str]) -> InputError:
    """Return the error for an unknown name, with the allowed ones and the nearest."""
    names = sorted(allowed)
    near = difflib.get_close_matches(given, names, n=1, cutoff=0.4)
    hint = f" Did you mean {near[0]!r}?" if near else ""
    return InputError(f"Unknown {kind} {given!r}. Allowed: {', '.join(names) or 'none'}.{hint}")
