"""Collect every problem of a file and report all of them at once."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

from taichidem.errors import InputError, TaichidemError, unknown_name
from taichidem.units import to_si


class FileError(InputError):
    """What is wrong with a file, every problem of it.

    Attributes:
        problems: one sentence each, that begins with the key or the line.
    """

    def __init__(self, where: str, problems: Iterable[str]) -> None:
        self.where = where
        self.problems = tuple(problems)
        count = len(self.problems)
        heading = f"{where} has {count} problem{'s' if count > 1 else ''}:"
        super().__init__("\n".join([heading, *(f"  {k}. {text}" for k, text in enumerate(self.problems, 1))]))

    def __reduce__(self) -> tuple:  # an exception is rebuilt from its text otherwise, which loses the list
        return type(self), (self.where, self.problems)


class Problems:
    """The problems found so far in one file."""

    def __init__(self, where: str) -> None:
        self.where = where
        self.found: list[str] = []

    def add(self, key: str, sentence: str) -> None:
        """Note a problem; the key stands in front unless the sentence begins with it."""
        line = sentence if sentence.startswith(key) else f"{key}: {sentence}"
        if line not in self.found:
            self.found.append(line)

    def unknown(self, key: str, kind: str, given: str, allowed: Iterable[str]) -> None:
        """Note a name that does not exist, with the allowed ones and the nearest."""
        self.add(key, str(unknown_name(kind, given, allowed)))

    def missing(self, key: str, what: str) -> None:
        """Note a key that must be given."""
        self.add(key, f"{key} is missing; {what}")

    @contextmanager
    def catching(self, key: str) -> Iterator[None]:
        """Note an error of the input that is raised within, and go on."""
        try:
            yield
        except TaichidemError as error:
            self.add(key, str(error))

    def quantity(self, key: str, value: object, unit: str) -> float | None:
        """Return a quantity in an SI unit, or None after noting why it is none."""
        with self.catching(key):
            return to_si(value, unit, key)
        return None

    def table(self, parent: Mapping[str, Any], key: str, path: str = "") -> Mapping[str, Any]:
        """Return the table under a key, empty where it is missing or (which is noted) no table."""
        value = parent.get(key, {})
        if isinstance(value, Mapping):
            return value
        self.add(path or key, f"{path or key} is {value!r}; it must be a table [{path or key}].")
        return {}

    def refuse_others(self, table: Mapping[str, Any], allowed: Collection[str], path: str, kind: str) -> None:
        """Note every key of a table that is not allowed."""
        for name in table:
            if name not in allowed:
                self.unknown(f"{path}.{name}" if path else name, kind, name, allowed)

    def concern(self, *sections: str) -> bool:
        """Return whether a problem was found in one of these sections."""
        return any(line.startswith(sections) for line in self.found)

    def raise_if_any(self) -> None:
        """Raise FileError with everything that was found."""
        if self.found:
            raise FileError(self.where, self.found)
