"""What the environments can be asked for."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from bench.errors import ParameterError, UnknownNameError
from bench.excitation.shaping import SHAPINGS
from bench.limits import READING_LIMITS, size_text

ENFORCEMENTS = ("terminate", "cost")

AVERAGES = ("prior", "posterior")

REWARDS = ("information", "coverage", "error")


@dataclass(frozen=True)
class Options:
    """What the environments can be asked for; see their documentation."""

    shaping: str = "knots"
    n_knots: int = 1
    window: float | None = None
    duration: float | None = None
    enforcement: str = "terminate"
    penalty: float = 10.0
    reward: str = "information"
    average: str = "prior"
    terminate_when_certain: bool = False

    def __post_init__(self) -> None:
        for kind, name, known in (
            ("shaping of actions", self.shaping, SHAPINGS),
            ("enforcement of limits", self.enforcement, ENFORCEMENTS),
            ("reward", self.reward, REWARDS),
            ("average of rewards", self.average, AVERAGES),
        ):
            if name not in known:
                raise UnknownNameError(kind, str(name), known)
        if not (is_number(self.penalty) and self.penalty >= 0.0):
            raise ParameterError(f"penalty is {self.penalty} nat; a number of at least 0 is expected")
        for name in ("window", "duration"):
            value = getattr(self, name)
            if value is not None and not (is_number(value) and value > 0.0):
                raise ParameterError(f"{name} is {value} s; a positive number is expected")
        require_count("n_knots", self.n_knots)
        if self.reward == "coverage" and self.terminate_when_certain:
            raise ParameterError(
                "terminate_when_certain came with reward='coverage', which tells nothing of rivals; reward='information' is expected"
            )


def require_count(name: str, value: Any, most: int | None = None) -> int:
    """The value of an argument that counts something.

    Raises:
        ParameterError: It is no whole number of at least one, or more than `most`.
    """
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or value < 1:
        raise ParameterError(f"{name} is {value}; a whole number of at least one is expected")
    if most is not None and value > most:
        raise ParameterError(f"{name} is {value}; at most {most} are expected")
    return int(value)


def check_size(numbers: int, what: str) -> None:
    """Refuse what would take more memory than any file that is read may.

    Raises:
        ParameterError: It would.
    """
    if numbers > READING_LIMITS.numbers:
        raise ParameterError(
            f"{what} takes {size_text(8.0 * numbers)}, and at most {size_text(8.0 * READING_LIMITS.numbers)} are taken: ask for shorter "
            "episodes, or for fewer environments or draws"
        )


def is_number(value: Any) -> bool:
    """Whether a value is a finite number."""
    return isinstance(value, int | float | np.number) and math.isfinite(value)
