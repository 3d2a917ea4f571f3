"""What every command shares: progress on standard error, results on standard output."""

from __future__ import annotations

import contextlib
import json
import signal
import threading
from collections.abc import Callable, Iterator
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from bench.files import json_values


@contextlib.contextmanager
def progress_bar(quiet: bool) -> Iterator[Callable[[str, float], None]]:
    """A progress bar on standard error; call what is given with a label and the share done."""
    if quiet:  # a disabled bar of rich before 15 still ends with an empty line
        yield lambda label, share: None
        return
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.percentage:>3.0f} %"),
        TimeElapsedColumn(),
    )
    with Progress(*columns, console=Console(stderr=True)) as bar:
        task = bar.add_task("starting", total=1.0)
        yield lambda label, share: bar.update(task, description=label, completed=share)


class Terminated(KeyboardInterrupt):
    """The system or its user asked the process to end (SIGTERM, SIGHUP): it stops as by Ctrl-C, and leaves nothing half.

    Attributes:
        status: Exit status, 128 and the number of the signal.
    """

    def __init__(self, number: int) -> None:
        super().__init__()
        self.status = 128 + number


@contextlib.contextmanager
def terminable() -> Iterator[None]:
    """Raise `Terminated` where a signal would end the process at once, with its files half written."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def end(number: int, _: object) -> None:
        raise Terminated(number)

    numbers = [getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name)]
    # one that is ignored stays so: nohup
    before = {number: signal.getsignal(number) for number in numbers}
    before = {number: handler for number, handler in before.items() if handler == signal.SIG_DFL}
    for number in before:
        signal.signal(number, end)
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def emit(document: Any) -> None:
    """Print JSON to standard output."""
    print(json.dumps(json_values(document), indent=1, ensure_ascii=False, allow_nan=False))
