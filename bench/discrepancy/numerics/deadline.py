"""A time budget: what there is no time for any more is left out, and said."""

from __future__ import annotations

import math
import time


class Deadline:
    """When work has to end.

    Args:
        seconds: From now on; no limit where infinite.
        skipped: What was left out for lack of time; a list of its own where None.

    Example:
        >>> Deadline().allows("a further search")
        True
        >>> late = Deadline(0.0)
        >>> late.allows("a further search"), late.skipped
        (False, ['a further search'])
    """

    def __init__(self, seconds: float = math.inf, skipped: list[str] | None = None) -> None:
        self.skipped: list[str] = [] if skipped is None else skipped
        self._end = time.monotonic() + seconds

    @property
    def over(self) -> bool:
        """Whether there is no time left."""
        return time.monotonic() >= self._end

    @property
    def untried(self) -> tuple[str, ...]:
        """What was left out, in a sentence for the warnings of a verdict; none where nothing was."""
        if not self.skipped:
            return ()
        return (f"there was no time for {'; '.join(self.skipped)}: a larger --budget may change the verdict",)

    def allows(self, what: str) -> bool:
        """Whether there is time left; what there is none for is noted."""
        if not self.over:
            return True
        if what not in self.skipped:
            self.skipped.append(what)
        return False

    def part(self, share: float) -> Deadline:
        """A deadline after a share of the time that is left; what is skipped is noted in the same list."""
        return Deadline(share * max(self._end - time.monotonic(), 0.0), self.skipped)


NEVER = Deadline()
"""No deadline."""
