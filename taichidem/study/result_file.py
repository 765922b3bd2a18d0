"""Results that programs read: a frozen dataclass that is one JSON file in a folder of results."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from taichidem.whole_file import write_whole

RESULTS = "results"  # folder of a study in which they lie


class ResultFile:
    """Base of results that are kept as JSON; a subclass is a dataclass with a field `folder`.

    Attributes:
        file: name of the file.
        schema: number of its format.
        hidden: fields that the file doesn't hold.
        folder: where it is written.
    """

    file: ClassVar[str] = ""
    schema: ClassVar[int] = 1
    hidden: ClassVar[tuple[str, ...]] = ("folder",)
    folder: Path

    def extra(self) -> Mapping[str, Any]:
        """Return what the file holds besides the fields; nothing by default."""
        return {}

    def as_dict(self) -> dict[str, Any]:
        """Return what the file holds, in plain types; missing numbers are None."""
        held = {name: value for name, value in vars(self).items() if name not in self.hidden}
        return plain({"schema": self.schema, **held, **self.extra()})

    def to_json(self) -> str:
        """Return the file as text."""
        return json.dumps(self.as_dict(), indent=2, ensure_ascii=False, allow_nan=False)

    def save(self) -> Path:
        """Write the file into the folder and return its path."""
        path = self.folder / self.file
        write_whole(path, self.to_json() + "\n")
        return path


def plain(value: Any) -> Any:
    """Return mappings, sequences and numbers as types that JSON knows; numbers that aren't finite become None."""
    if isinstance(value, Mapping):
        return {str(key): plain(inner) for key, inner in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(inner) for inner in value]
    if isinstance(value, np.generic):
        value = value.item()
    return None if isinstance(value, float) and not math.isfinite(value) else value
