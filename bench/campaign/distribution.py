"""What a plan may write instead of a number: a distribution, given by its inverse cumulative distribution function.

Everything random in a plan comes from one number ``u`` in [0, 1) a quantity, whether ``u`` is a random number, a coordinate
of a Latin hypercube or of a Sobol sequence: the design of an experiment and the distributions of its factors stay apart.

In a plan file a distribution is a table with its name as the key::

    { uniform = [low, high] }
    { log_uniform = [low, high] }
    { normal = [mean, std], low = …, high = … }     # truncated where low or high is given
    { integers = [low, high] }                      # both ends included
    { choice = [a, b, c], weights = [1, 1, 2] }     # numbers or names
    { shared = "level", times = 0.5 }               # the quantity of that name in the plan's table `shared`
"""

from __future__ import annotations

import bisect
import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate
from typing import Any

from bench.errors import ParameterError

Value = float | int | str | bool
"""What a quantity of a plan comes out as."""


@dataclass(frozen=True)
class Distribution(ABC):
    """A distribution of one quantity."""

    @abstractmethod
    def at(self, u: float) -> Value:
        """The quantile of `u` in [0, 1)."""

    @abstractmethod
    def to_dict(self) -> dict[str, Any]:
        """The table that stands for it in a plan."""

    @property
    def textual(self) -> bool:
        """Whether it draws names instead of numbers."""
        return False


def _finite(kind: str, **values: float) -> None:
    for name, value in values.items():
        if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
            raise ParameterError(
                f"{name} of the distribution '{kind}' is {value!r}; a finite number is expected"
            )


@dataclass(frozen=True)
class Uniform(Distribution):
    """Uniform between `low` and `high`."""

    low: float
    high: float

    def __post_init__(self) -> None:
        _finite("uniform", low=self.low, high=self.high)
        if not self.low < self.high:
            raise ParameterError(
                f"uniform = [{self.low:g}, {self.high:g}] is empty; give the lower end first"
            )

    def at(self, u: float) -> float:
        """``low + u (high - low)``."""
        return self.low + u * (self.high - self.low)

    def to_dict(self) -> dict[str, Any]:
        """As in a plan."""
        return {"uniform": [self.low, self.high]}


@dataclass(frozen=True)
class LogUniform(Distribution):
    """Uniform in the logarithm, between `low` and `high`, both positive."""

    low: float
    high: float

    def __post_init__(self) -> None:
        _finite("log_uniform", low=self.low, high=self.high)
        if not 0.0 < self.low < self.high:
            raise ParameterError(
                f"log_uniform = [{self.low:g}, {self.high:g}] came; two positive numbers, the lower first, are expected"
            )

    def at(self, u: float) -> float:
        """``low (high / low)^u``."""
        return self.low * math.exp(u * math.log(self.high / self.low))

    def to_dict(self) -> dict[str, Any]:
        """As in a plan."""
        return {"log_uniform": [self.low, self.high]}


@dataclass(frozen=True)
class Normal(Distribution):
    """Normal with `mean` and `std`, truncated to [low, high] where these are given."""

    mean: float
    std: float
    low: float = -math.inf
    high: float = math.inf

    def __post_init__(self) -> None:
        _finite("normal", mean=self.mean, std=self.std)
        if not (self.std > 0.0 and self.low < self.high) or self._probability(self.high) <= self._probability(
            self.low
        ):
            raise ParameterError(
                f"normal = [{self.mean:g}, {self.std:g}] between {self.low:g} and {self.high:g} came; std must be positive and "
                "the interval must hold some probability"
            )

    def _probability(self, value: float) -> float:
        return 0.5 * math.erfc((self.mean - value) / (self.std * math.sqrt(2.0)))

    def at(self, u: float) -> float:
        """``mean + std Phi^-1(P(low) + u (P(high) - P(low)))``, kept within [low, high]."""
        from scipy.special import ndtri  # noqa: PLC0415  (0.1 s that reading a plan need not pay)

        low, high = self._probability(self.low), self._probability(self.high)
        # u = 0 comes once in 2^53 draws and would be minus infinity
        inside = min(max(low + u * (high - low), 2.0**-54), 1.0 - 2.0**-53)
        return min(max(self.mean + self.std * float(ndtri(inside)), self.low), self.high)

    def to_dict(self) -> dict[str, Any]:
        """As in a plan."""
        ends = {"low": self.low, "high": self.high}
        return {"normal": [self.mean, self.std]} | {k: v for k, v in ends.items() if math.isfinite(v)}


@dataclass(frozen=True)
class Integers(Distribution):
    """A whole number from `low` to `high`, both included, all alike."""

    low: int
    high: int

    def __post_init__(self) -> None:
        if self.low > self.high:
            raise ParameterError(f"integers = [{self.low}, {self.high}] is empty; give the lower end first")

    def at(self, u: float) -> int:
        """The quantile."""
        return min(self.low + int(u * (self.high - self.low + 1)), self.high)

    def to_dict(self) -> dict[str, Any]:
        """As in a plan."""
        return {"integers": [self.low, self.high]}


@dataclass(frozen=True)
class Choice(Distribution):
    """One of `values`, by `weights`; all alike without."""

    values: tuple[Value, ...]
    weights: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        if not self.values or len({isinstance(value, str) for value in self.values}) != 1:
            raise ParameterError(
                f"choice = {list(self.values)!r} came; a list of numbers, or one of names, is expected"
            )
        if self.weights and len(self.weights) != len(self.values):
            raise ParameterError(
                f"choice has {len(self.values)} values and {len(self.weights)} weights; one each is expected"
            )
        if self.weights:
            check_weights("choice", self.weights)

    @property
    def textual(self) -> bool:
        """Whether the values are names."""
        return isinstance(self.values[0], str)

    def at(self, u: float) -> Value:
        """The quantile, in the order of the values."""
        return self.values[pick(u, self.weights or (1.0,) * len(self.values))]

    def to_dict(self) -> dict[str, Any]:
        """As in a plan."""
        return {"choice": list(self.values)} | ({"weights": list(self.weights)} if self.weights else {})


@dataclass(frozen=True)
class Shared:
    """A quantity that takes its value from the plan's table `shared`, so that several vary together.

    Attributes:
        name: Name in the table.
        times: Factor.
    """

    name: str
    times: float = 1.0

    def to_dict(self) -> dict[str, Any]:
        """As in a plan."""
        return {"shared": self.name} | ({"times": self.times} if self.times != 1.0 else {})


Quantity = Value | Distribution | Shared
"""What a plan says of one quantity."""


def check_weights(owner: str, weights: Sequence[float]) -> None:
    """Raise `ParameterError` unless the weights are finite, not negative, and not all zero."""
    for weight in weights:
        _finite(owner, weight=weight)
    if min(weights) < 0.0 or sum(weights) <= 0.0:
        raise ParameterError(f"the weights of {owner} are {list(weights)}; numbers above zero are expected")


def pick(u: float, weights: Sequence[float]) -> int:
    """Index whose share of the cumulated weights holds `u` in [0, 1)."""
    sums = list(accumulate(weights))
    return min(bisect.bisect_right(sums, u * sums[-1]), len(weights) - 1)
