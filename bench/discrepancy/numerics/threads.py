"""Work shared out over threads: fits, free runs and screened responses, all of which leave the interpreter for compiled code.

A diagnosis is threads within threads: hypotheses are fitted side by side, and each fit wants the columns of its Jacobian. So
whoever has items to work through works through them itself, idle threads take some off it, and so does whoever waits for the last
of its own. Nobody waits for an item that no thread has begun, hence nothing can lock, and the last of several long fits is not left
to one thread alone. Results do not depend on who did what.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, TypeVar

_Item = TypeVar("_Item")
_Result = TypeVar("_Result")


@dataclass(frozen=True)
class ThreadsSettings:
    """Numbers of `bench.discrepancy.numerics.threads`."""

    most: int = 4
    """Threads of a diagnosis, at most: what the interpreter does between compiled parts lets more of them wait for each other."""


SETTINGS = ThreadsSettings()
THREADS = min(SETTINGS.most, os.cpu_count() or 1)

_changed = threading.Condition()
_open: list[_Shared] = []
"""Work whose items are not all done, under `_changed`."""
_here = threading.local()
"""How deep within other work a thread is."""


def in_threads(function: Callable[[_Item], _Result], items: Iterable[_Item]) -> list[_Result]:
    """Results of a function for all items, in their order; callable from any thread, within other such work too.

    Args:
        function: Safe to be called from several threads at once.
        items: What it is called with.

    Raises:
        Exception: What the function raised, once the items that were begun are done; no further ones are.

    Examples:
        >>> in_threads(lambda x: x * x, range(5))
        [0, 1, 4, 9, 16]
    """
    shared = _Shared(function, list(items), getattr(_here, "depth", 0))
    helpers = min(THREADS, len(shared.found)) - 1
    if helpers < 1:
        return [function(item) for item in shared.items]
    with _changed:
        _open.append(shared)
        _changed.notify_all()
    try:
        for _ in range(helpers):
            _helpers().submit(_work)
        _work(shared)
    finally:
        with _changed:
            _open.remove(shared)
    if shared.failures:
        raise shared.failures[0]
    return shared.found


class _Shared:
    """Items that several threads work through; numbers change under `_changed`."""

    def __init__(self, function: Callable[[Any], Any], items: list, depth: int) -> None:
        self.function, self.items, self.depth = function, items, depth
        self.found: list[Any] = [None] * len(items)
        self.failures: list[BaseException] = []
        self.begun, self.undone = 0, len(items)

    def take(self) -> int | None:
        """Number of an item that is to be begun; None where there is none."""
        if self.begun == len(self.items) or self.failures:
            return None
        self.begun += 1
        return self.begun - 1

    @property
    def done(self) -> bool:
        """Whether no thread is at an item, and none will be."""
        return self.undone == 0 or (bool(self.failures) and self.undone == len(self.items) - self.begun)

    def run(self, i: int) -> None:
        """Call the function with an item."""
        outside, _here.depth = getattr(_here, "depth", 0), self.depth + 1
        failures = []
        try:
            self.found[i] = self.function(self.items[i])
        except BaseException as failure:
            failures.append(failure)
        _here.depth = outside
        with _changed:
            self.undone -= 1
            self.failures += failures
            _changed.notify_all()


def _work(own: _Shared | None = None) -> None:
    """Run items: until those of `own` are done, or where None as long as there are any."""
    while True:
        with _changed:
            taken = _next(own)
            while taken is None and own is not None and not own.done:
                _changed.wait()
                taken = _next(own)
        if taken is None:
            return
        shared, i = taken
        shared.run(i)


def _next(own: _Shared | None) -> tuple[_Shared, int] | None:
    """An item to be run: of `own` first, of nothing that is less deep, since that takes longer than what is waited for."""
    if own is not None and own.done:
        return None
    others = [s for s in _open if s is not own and (own is None or s.depth >= own.depth)]
    for shared in [*([own] if own else []), *sorted(others, key=lambda s: s.depth)]:
        i = shared.take()
        if i is not None:
            return shared, i
    return None


@lru_cache(maxsize=1)
def _helpers() -> ThreadPoolExecutor:
    """Threads that take items off those who have some."""
    return ThreadPoolExecutor(max(THREADS - 1, 1), thread_name_prefix="diagnosis")
