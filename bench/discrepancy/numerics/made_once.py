"""Values that several threads ask for: each made once, the last few kept."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Hashable
from threading import Lock
from typing import Generic, TypeVar

_Value = TypeVar("_Value")


class MadeOnce(Generic[_Value]):
    """Values by key. Who asks for one that is being made waits for it, and for no other.

    Args:
        most: Values kept, those that were asked for last.

    Examples:
        >>> squares = MadeOnce[int](2)
        >>> squares.get(3, lambda: 9), squares.get(3, lambda: 10)
        (9, 9)
    """

    def __init__(self, most: int) -> None:
        self._most, self._lock = most, Lock()
        self._entries: OrderedDict[Hashable, _Entry[_Value]] = OrderedDict()

    def get(self, key: Hashable, make: Callable[[], _Value]) -> _Value:
        """The value of a key, made where it is not kept.

        Args:
            key: What it is asked for by.
            make: Makes it; hands no work to other threads, which might ask for it.
        """
        with self._lock:
            entry = self._entries.setdefault(key, _Entry())
            self._entries.move_to_end(key)
            if len(self._entries) > self._most:
                self._entries.popitem(last=False)
        with entry.lock:
            if not entry.made:
                entry.made.append(make())
            return entry.made[0]


class _Entry(Generic[_Value]):
    """A value that is made, or will be by who holds the lock."""

    def __init__(self) -> None:
        self.lock = Lock()
        self.made: list[_Value] = []
