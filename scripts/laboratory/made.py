"""Cases as a laboratory has them: integration, loads, noise, and what is right of each."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from bench.arrays import Array
from bench.discrepancy import Case, CaseChannel, NominalParameter, record_from_arrays
from bench.signals import Multisine

STEP = 1.0 / 500.0
"""Time between samples [s]."""
SUBSTEPS = 10
"""Steps of the integration a sample."""
Rate = Callable[[Array, Array], Array]
"""States (n_states, n_records) and inputs (n_inputs, n_records) to rates (n_states, n_records)."""
Signals = dict[str, Array]


@dataclass(frozen=True)
class Made:
    """A case and what is right of it.

    Attributes:
        name: Of its folder.
        case: The case.
        right: Groups of names, any one of which is right.
        also: Names that may stand beside them.
        why: What is there.
    """

    name: str
    case: Case
    right: Sequence[Sequence[str]]
    also: Sequence[str]
    why: str


def march(rate: Rate, start: Array, inputs: Array) -> Array:
    """States (n_samples, n_states, n_records) under inputs (n_samples, n_inputs, n_records) that are linear between samples."""
    state, h = start, STEP / SUBSTEPS
    out = [state]
    for before, after in pairwise(inputs):
        for i in range(SUBSTEPS):
            first, middle, last = (
                before + (i + part) / SUBSTEPS * (after - before) for part in (0.0, 0.5, 1.0)
            )
            k1 = rate(state, first)
            k2 = rate(state + 0.5 * h * k1, middle)
            k3 = rate(state + 0.5 * h * k2, middle)
            k4 = rate(state + h * k3, last)
            state = state + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
        out.append(state)
    return np.array(out)


def with_rates(rate: Rate, start: Array, inputs: Array) -> tuple[Array, Array]:
    """States as of `march`, and their rates, shaped alike."""
    states = march(rate, start, inputs)
    return states, np.array([rate(s, u) for s, u in zip(states, inputs, strict=True)])


def multisines(
    rng: np.random.Generator, seconds: float, low: float, high: float, rms: Sequence[float]
) -> Array:
    """Random motions or loads (n_samples, n_records) with all frequencies of a band."""
    n = round(seconds / STEP)
    return np.array([Multisine(band=(low, high), rms=one).sample(n, 1.0 / STEP, rng) for one in rms]).T


def noisy(rng: np.random.Generator, record: Mapping[str, Array], noise: Mapping[str, float]) -> Signals:
    """A record with white noise on each channel."""
    return {name: x + noise[name] * rng.standard_normal(len(x)) for name, x in record.items()}


def case_of(
    name: str,
    rig: str,
    parameters: Mapping[str, tuple[float, float, str]],
    channels: Mapping[str, tuple[str, str, float]],
    records: Sequence[Signals],
) -> Case:
    """A case of records, the last of which judges."""
    time = STEP * np.arange(len(next(iter(records[0].values()))))
    labels = [*(f"identification_{i + 1}" for i in range(len(records) - 1)), "validation"]
    made = [
        record_from_arrays(label, time, {c: record[c] for c in channels})
        for label, record in zip(labels, records, strict=True)
    ]
    stated = tuple(NominalParameter(key, *entry) for key, entry in parameters.items())
    told = tuple(CaseChannel(key, *entry) for key, entry in channels.items())
    return Case(name, rig, stated, told, tuple(made[:-1]), tuple(made[-1:]))


def unstated(made: Made) -> Made:
    """The same case with nothing said of its noise; the motion of a machine is known as before."""
    channels = tuple(c if c.role == "prescribed" else replace(c, noise_std=None) for c in made.case.channels)
    return replace(made, name=f"{made.name}_unstated", case=replace(made.case, channels=channels))
