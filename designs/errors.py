"""The error that designs raise, saying what was given, what is allowed and what to do."""

from __future__ import annotations

import difflib
from collections.abc import Iterable


class DesignError(ValueError):
    """A factor, a factor space or a design that can't be made as asked."""


def nearest_hint(given: str, allowed: Iterable[str]) -> str:
    """Return ``"Allowed: a, b. Did you mean 'b'?"`` for an unknown name."""
    names = [str(name) for name in allowed]
    near = difflib.get_close_matches(given, names, n=1, cutoff=0.4)
    hint = f" Did you mean {near[0]!r}?" if near else ""
    return f"Allowed: {', '.join(names) or 'none'}.{hint}"


def nearest_counts(given: int, possible: Iterable[int]) -> str:
    """Return the possible run counts on either side of the one asked for, as words."""
    counts = sorted(set(possible))
    below = [count for count in counts if count < given][-1:]
    above = [count for count in counts if count > given][:1]
    return " or ".join(str(count) for count in below + above) or "none"
