"""What every command shares: progress on standard error, results on standard output."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Callable, Iterator
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from bench.files import json_values


@contextlib.contextmanager
def progress_bar(quiet: bool) -> Iterator[Callable[[str, float], None]]:
    """A progress bar on standard error; call what is given with a label and the share done."""
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.percentage:>3.0f} %"),
        TimeElapsedColumn(),
    )
    with Progress(*columns, console=Console(stderr=True), disable=quiet) as bar:
        task = bar.add_task("starting", total=1.0)
        yield lambda label, share: bar.update(task, description=label, completed=share)


def emit(document: Any) -> None:
    """Print JSON to standard output."""
    print(json.dumps(json_values(document), indent=1, ensure_ascii=False, allow_nan=False))
