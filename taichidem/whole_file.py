"""Write files such that each is whole or as it was, also if the program is killed or the disk is full."""

from __future__ import annotations

import os
import platform
import zlib
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

HOST = f"{zlib.crc32(platform.node().encode()):08x}"  # of this machine; on a network drive others write too


@contextmanager
def whole_file(path: str | Path) -> Iterator[Path]:
    """Give another name beside a file to write to, and rename what was written there into its place.

    What killed processes of this machine left of the same file is deleted.

    Args:
        path: of the file; one that is there is replaced at the end, or left as it is if an error comes before. A device or
            a pipe can't be replaced and is written to.

    Raises:
        OSError: it can't be written.
    """
    target = Path(path)
    if target.exists() and not (target.is_file() or target.is_dir()):  # else root's /dev/null would become a file
        yield target
        return
    target = target.resolve()  # what a link leads to; the link stays one
    _clear_away_parts(target)
    fresh = target.with_name(str(os.getpid()).join(_around_process(target)))
    try:
        yield fresh
        with fresh.open("r+b") as written:  # Windows syncs only what may be written to
            os.fsync(written.fileno())  # else a power cut may keep the new name and lose what it names
        fresh.replace(target)
        _sync_folder(target.parent)
    except BaseException:
        fresh.unlink(missing_ok=True)
        raise


def _around_process(target: Path) -> tuple[str, str]:
    """Return what stands before and after the writer's process number in the name of a file that is being written."""
    return f".{target.stem}.{HOST}-", f".part{target.suffix}"  # writers of pictures ask the suffix


def _clear_away_parts(target: Path) -> None:
    """Delete unfinished files of a target whose writers no longer live; of other machines' writers nothing is known here."""
    if os.name != "posix":  # elsewhere asking whether a process lives may end it
        return
    start, end = _around_process(target)
    with suppress(OSError):  # it is only tidying; a folder that can't be read may still be written to
        for name in os.listdir(target.parent):
            process = name.removeprefix(start).removesuffix(end)
            if name == f"{start}{process}{end}" and process.isdecimal() and not _lives(int(process)):
                target.with_name(name).unlink(missing_ok=True)


def _lives(process: int) -> bool:
    try:
        os.kill(process, 0)  # sends nothing
    except ProcessLookupError:
        return False
    except (OSError, OverflowError):  # such as one of another user
        return True
    return True


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
