"""What a logger does wrong: samples that drop out or jump, rows that are lost, a clock that jitters."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from bench.arrays import Array


class Table(NamedTuple):
    """A record as it is logged."""

    t: Array
    """Times [s] (n_rows,)."""
    columns: dict[str, Array]
    """Values of each channel in its unit, (n_rows,)."""


def late(samples: Array, rate: float, seconds: float) -> Array:
    """Samples (n,) at a rate [Hz] that come some time [s] late; the first stands before."""
    t = np.arange(len(samples)) / rate
    return np.interp(t - seconds, t, samples, left=samples[0])


@dataclass(frozen=True)
class Fault(ABC):
    """A fault of a logger."""

    @abstractmethod
    def logged(self, rng: np.random.Generator, table: Table) -> Table:
        """A record as it is logged with the fault."""


@dataclass(frozen=True)
class Dropouts(Fault):
    """A channel that reads zero for 4 to 29 samples, some times a record."""

    channel: str
    count: int

    def logged(self, rng: np.random.Generator, table: Table) -> Table:
        """As of `Fault.logged`."""
        values = table.columns[self.channel].copy()
        for i in rng.integers(300, len(values) - 300, self.count).tolist():
            values[i : i + rng.integers(4, 30)] = 0.0
        return Table(table.t, {**table.columns, self.channel: values})


@dataclass(frozen=True)
class Spikes(Fault):
    """A channel with single samples, some a record, that are off by a multiple of its standard deviation.

    Attributes:
        channel: Its name.
        count: Spikes of a record.
        least: Smallest multiple.
        most: Largest multiple.
    """

    channel: str
    count: int
    least: float
    most: float

    def logged(self, rng: np.random.Generator, table: Table) -> Table:
        """As of `Fault.logged`."""
        values = table.columns[self.channel].copy()
        spread = np.std(values)
        for i in rng.integers(200, len(values) - 200, self.count).tolist():
            values[i] += rng.choice([-1, 1]) * rng.uniform(self.least, self.most) * spread
        return Table(table.t, {**table.columns, self.channel: values})


@dataclass(frozen=True)
class Jitter(Fault):
    """A clock whose samples are taken early or late by a share of a sample; the times are the true ones."""

    share: float

    def logged(self, rng: np.random.Generator, table: Table) -> Table:
        """As of `Fault.logged`."""
        off = self.share * rng.standard_normal(len(table.t)).clip(-3.0, 3.0)
        t = table.t + table.t[1] * off
        t[0] = 0.0
        return Table(t, {name: np.interp(t, table.t, values) for name, values in table.columns.items()})


@dataclass(frozen=True)
class LostRows(Fault):
    """Rows of a record that are not written."""

    count: int

    def logged(self, rng: np.random.Generator, table: Table) -> Table:
        """As of `Fault.logged`."""
        kept = np.ones(len(table.t), bool)
        kept[rng.integers(100, len(kept) - 100, self.count)] = False
        return Table(table.t[kept], {name: values[kept] for name, values in table.columns.items()})
