"""A progress bar with the time left, on standard error so that results stay clean."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

MEMORY = 300.0  # [s] of progress from which the time left is estimated; batches of a campaign differ much in speed


@contextmanager
def progress(quiet: bool = False) -> Iterator[Callable[[str, float], None]]:
    """Give a function (stage, share done) that draws a bar per stage."""
    columns = (TextColumn("{task.description:>10}"), BarColumn(), TextColumn("{task.percentage:>3.0f} %"))
    bar = Progress(
        *columns,
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
        console=Console(stderr=True),
        disable=quiet,
        speed_estimate_period=MEMORY,
    )
    tasks: dict[str, int] = {}

    def tell(stage: str, share: float) -> None:
        if stage not in tasks:
            for earlier in tasks.values():
                bar.update(earlier, completed=1.0)  # type: ignore[arg-type]
            tasks[stage] = bar.add_task(stage, total=1.0)
        bar.update(tasks[stage], completed=share)  # type: ignore[arg-type]

    with bar:
        yield tell
        for task in tasks.values():
            bar.update(task, completed=1.0)  # type: ignore[arg-type]
