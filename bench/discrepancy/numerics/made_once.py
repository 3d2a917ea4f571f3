"""Values that several threads ask for: each made once, the last few kept."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Hashable, Sequence
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
        return self.get_each([key], lambda _: make())[0]

    def get_each(self, keys: Sequence[Hashable], make: Callable[[int], _Value]) -> list[_Value]:
        """The values of several keys: those that nobody else is making are made here, and the others then waited for.

        Args:
            keys: What they are asked for by.
            make: Takes the number of a key to its value; as of `get`.
        """
        with self._lock:
            entries = [self._entries.setdefault(key, _Entry()) for key in keys]
            for key in keys:
                self._entries.move_to_end(key)
            while len(self._entries) > self._most:
                self._entries.popitem(last=False)
        for waiting in (False, True):
            for k, entry in enumerate(entries):
                if not entry.made and entry.lock.acquire(blocking=waiting):
                    try:
                        if not entry.made:
                            entry.made.append(make(k))
                    finally:
                        entry.lock.release()
        return [entry.made[0] for entry in entries]


class _Entry(Generic[_Value]):
    """A value that is made, or will be by who holds the lock."""

    def __init__(self) -> None:
        self.lock = Lock()
        self.made: list[_Value] = []
