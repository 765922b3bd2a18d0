"""Write files such that each is whole or as it was, also if the program is killed or the disk is full."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any


@contextmanager
def whole_file(path: str | Path) -> Iterator[Path]:
    """Give another name beside a file to write to, and rename what was written there into its place.

    Args:
        path: of the file; one that is there is replaced at the end, or left as it is if an error comes before.

    Raises:
        OSError: it can't be written.
    """
    target = Path(path)
    fresh = target.with_name(f".{target.stem}.{os.getpid()}.part{target.suffix}")  # writers of pictures ask the suffix
    try:
        yield fresh
        with fresh.open("rb") as written:
            os.fsync(written.fileno())  # else a power cut may keep the new name and lose what it names
        fresh.replace(target)
        _sync_folder(target.parent)
    except BaseException:
        fresh.unlink(missing_ok=True)
        raise


def _sync_folder(folder: Path) -> None:
    """Let the new name reach the disk too, where the system has folders that can be opened."""
    if os.name != "posix":
        return
    number = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(number)
    finally:
        os.close(number)


def write_whole(path: str | Path, text: str) -> None:
    """Write a text in UTF-8 as a file that is whole or as it was.

    Raises:
        OSError: it can't be written.
    """
    with whole_file(path) as fresh:
        fresh.write_text(text, encoding="utf-8")


def save_figure(figure: Any, path: str | Path, **options: Any) -> None:
    """Write a figure of Matplotlib as a picture that is whole or as it was; `options` go to `savefig`.

    Raises:
        OSError: it can't be written.
    """
    with whole_file(path) as fresh:
        figure.savefig(fresh, **options)
