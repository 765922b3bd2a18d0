"""Checkpoint files: a NumPy archive of a header and one run of bytes, written whole or not at all, checked before use."""

from __future__ import annotations

import json
import os
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from taichidem import __version__
from taichidem.bodies import Bodies
from taichidem.checkpoints.packing import Packer
from taichidem.errors import InputError
from taichidem.physics_version import PHYSICS_VERSION
from taichidem.shapes.forms import Forms
from taichidem.snapshot import Frame, Snapshot, WallState
from taichidem.whole_file import whole_file

PROGRAM = "taichidem"
FORMAT = 1  # raise it when the layout of the file or the meaning of an entry changes
TYPES = (Bodies, Forms, Frame, Snapshot, WallState)
HASH = "sha256:"  # before what tells a difference and shows nothing
SHORT = 60  # characters up to which a refusal shows what was run


def check_writable(path: Path) -> None:
    """Raise InputError unless a checkpoint can be written to a path."""
    if path.is_dir():
        raise InputError(f"The checkpoint {path} is a folder. Give the name of a file.")
    if not path.parent.is_dir():
        raise InputError(
            f"The checkpoint {path} would lie in a folder that doesn't exist. Make it, or give another file."
        )
    if not os.access(path.parent, os.W_OK):
        raise InputError(f"The checkpoint {path} lies in a folder that can't be written to. Give another file.")


def write_checkpoint(path: Path, content: str, about: Mapping[str, Any], state: Any) -> None:
    """Write a checkpoint in the place of an older one.

    The new file is complete on the disk before it takes the old one's name, so that a process killed at any moment leaves
    one of the two whole.

    Args:
        path: of the file.
        content: what kind of thing it holds, "simulation" or "experiment".
        about: what it belongs to, in plain values; `read_checkpoint` compares them.
        state: anything that `Packer` packs.

    Raises:
        InputError: a path that can't be written to.
    """
    check_writable(path)
    packer = Packer(TYPES)
    header = {"program": PROGRAM, "version": __version__, "format": FORMAT, "physics": PHYSICS_VERSION}
    header |= {"content": content, "about": dict(about), "state": packer.pack(state)}
    text = np.frombuffer(json.dumps(header).encode(), np.uint8)
    try:
        with whole_file(path) as fresh, fresh.open("wb") as file:
            np.savez(file, header=text, data=np.frombuffer(packer.data, np.uint8))
    except OSError as problem:
        raise InputError(
            f"The checkpoint {path} can't be written ({problem.strerror}). Make room, or give another file."
        ) from problem


def read_checkpoint(path: Path, content: str, about: Mapping[str, Any]) -> Any:
    """Return the state that a checkpoint holds.

    Raises:
        InputError: no such file, one that is damaged or no checkpoint, or one of another version, content or subject.
    """
    if not path.is_file():
        raise InputError(f"There is no checkpoint {path}. Give a file that was written before.")
    header = _check_header(path, content, about)
    try:
        return Packer(TYPES, _read(path, "data")).unpack(header["state"])
    except (KeyError, TypeError, ValueError) as problem:
        raise _damaged(path) from problem


def may_be_replaced(path: Path, content: str, about: Mapping[str, Any]) -> bool:
    """Return whether there is no file, or a checkpoint that `read_checkpoint` would take for the same thing."""
    if not path.exists():
        return True
    try:
        _check_header(path, content, about)
    except InputError:
        return False
    return True


def _check_header(path: Path, content: str, about: Mapping[str, Any]) -> dict[str, Any]:
    """Return the header of a file, or raise InputError where it is of another version, content or subject."""
    text = _read(path, "header") or b"{}"
    try:
        header = json.loads(text)
    except ValueError as problem:
        raise _damaged(path) from problem
    _check_origin(path, header)
    if header["content"] != content:
        raise InputError(f"The checkpoint {path} is of {header['content']}, not of {content}. Give another file.")
    for name, ours in about.items():
        theirs = header["about"].get(name)
        if theirs != ours:
            raise InputError(_difference(path, name, theirs, ours))
    return header


def _read(path: Path, entry: str) -> bytes:
    """Return one entry of the archive; nothing where it lacks that."""
    try:
        with np.load(path, allow_pickle=False) as archive:
            return archive[entry].tobytes() if entry in archive.files else b""
    except (AttributeError, TypeError) as problem:  # an array alone, which NumPy reads too
        raise _foreign(path) from problem
    except (OSError, ValueError, EOFError, KeyError, zipfile.BadZipFile) as problem:
        raise _damaged(path) from problem


def _damaged(path: Path) -> InputError:
    return InputError(
        f"The checkpoint {path} can't be read: it is damaged, cut off, or no checkpoint. Give another file, or delete it to "
        "start from the beginning."
    )


def _foreign(path: Path) -> InputError:
    return InputError(
        f"{path} is no checkpoint of {PROGRAM}. Give a file that {PROGRAM} wrote, or one that doesn't exist."
    )


def _check_origin(path: Path, header: Any) -> None:
    if not isinstance(header, dict) or header.get("program") != PROGRAM:
        raise _foreign(path)
    written_by = f"written by {PROGRAM} {header.get('version')}"
    for name, ours in (("format", FORMAT), ("physics", PHYSICS_VERSION)):
        if header.get(name) != ours:
            raise InputError(
                f"The checkpoint {path}, {written_by}, is of {name} version {header.get(name)!r}; this one, {__version__}, "
                f"goes on from {name} version {ours!r} alone. Finish it with the program that wrote it, or delete it to "
                "start from the beginning."
            )


def _difference(path: Path, name: str, theirs: Any, ours: Any) -> str:
    shown = [str(value) for value in (theirs, ours)]
    plain = max(map(len, shown)) <= SHORT and not any(text.startswith(HASH) for text in shown)
    told = f" ({shown[0]} there, {shown[1]} here)" if plain else ""
    return (
        f"The checkpoint {path} doesn't belong to this run, which differs in its {name}{told}. Run what it was written for, give "
        "another file, or delete it to start from the beginning."
    )
