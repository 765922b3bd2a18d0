"""Files that a reproduction writes and a person may change: what she changed is hers and stays."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from hashlib import sha256
from pathlib import Path

from taichidem.whole_file import write_whole

RECORD = "as_written.json"


def write_unless_changed(folder: Path, texts: Mapping[str, str]) -> None:
    """Write texts into a folder, but into no file that holds something else than what was written into it here before.

    SHA-256 of what was written is kept in a file beside them; without that file, whatever is there counts as a person's own.

    Args:
        folder: that holds the files.
        texts: name of a file → what it shall hold.
    """
    hers = changed(folder, texts)
    written = {name: text for name, text in texts.items() if name not in hers}
    record = _record(folder)
    for name, text in written.items():  # what was there before counts as ours too, since a kill may leave it there
        record[name] = [*record.get(name, [])[-1:], _digest(text)]
    write_whole(folder / RECORD, json.dumps(record, indent=2) + "\n")
    for name, text in written.items():
        write_whole(folder / name, text)


def changed(folder: Path, names: Iterable[str]) -> tuple[str, ...]:
    """Return which of some files hold something else than what was written into them here."""
    record = _record(folder)
    return tuple(
        name for name in names if (file := folder / name).is_file() and _digest(_text(file)) not in record.get(name, [])
    )


def _record(folder: Path) -> dict[str, list[str]]:
    file = folder / RECORD
    try:
        held = json.loads(_text(file)) if file.is_file() else {}
        return {name: list(digests) for name, digests in held.items()}
    except (ValueError, AttributeError):  # damaged: then nothing is known to be ours, and nothing is overwritten
        return {}


def _text(file: Path) -> str:
    return file.read_text(encoding="utf-8", errors="replace")


def _digest(text: str) -> str:
    return sha256(text.encode("utf-8")).hexdigest()
