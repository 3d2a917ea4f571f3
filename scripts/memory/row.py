"""One figure of the comparison."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

Progress = Callable[[str], None]
"""Called with what is being done."""


class Row(NamedTuple):
    """One figure.

    Attributes:
        task: Name of the task.
        model: Name of the model.
        quantity: What was scored.
        value: The figure; infinite where the simulation diverged.
        unit: Its unit.
        limit: Largest value that holds (smallest where `least`); None where the figure is only reported.
        least: Whether the limit is a lower one.
        note: What a reader has to know.
    """

    task: str
    model: str
    quantity: str
    value: float
    unit: str
    limit: float | None = None
    least: bool = False
    note: str = ""

    @property
    def holds(self) -> bool | None:
        """Whether the limit is kept; None without one."""
        if self.limit is None:
            return None
        return bool(self.value >= self.limit if self.least else self.value <= self.limit)

    def to_dict(self) -> dict[str, Any]:
        """JSON values; a simulation that diverged has no value."""
        value = self.value if math.isfinite(self.value) else None
        return self._asdict() | {"value": value, "holds": self.holds}
