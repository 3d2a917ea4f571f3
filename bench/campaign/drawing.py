"""What each record draws: a rig, an excitation, sensors, and a value for each quantity.

All of it is a function of the plan and the number of the record, never of the records drawn before or of who asks, so
that the bytes of a campaign do not depend on workers, parts or interruptions.
"""

from __future__ import annotations

import threading
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache
from itertools import repeat
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bench.campaign.distribution import Distribution, Quantity, Shared, Value, pick
from bench.campaign.plan import Plan
from bench.errors import ParameterError


@dataclass(frozen=True)
class RecordDrawSettings:
    """Numbers of `bench.campaign.drawing`."""

    choices: int = 3
    """Leading coordinates of a point: rig, excitation, sensors."""
    sobol_block: int = 1 << 14
    """Points of a Sobol sequence made at a time: it can only be wound forwards, which takes a while far out."""
    largest_hypercube: int = 20_000_000
    """Numbers of a Latin hypercube, which must be held whole: 160 MB."""


SETTINGS = RecordDrawSettings()

_designing = threading.Lock()


class RecordDraw(NamedTuple):
    """One record's draw.

    Attributes:
        record: Number of the record.
        rig: Index of its rig.
        excitation: Index of its excitation.
        sensors: Index of its sensors; −1 for true values.
        present: Which elements of the rig it has.
        values: Value by column of the tables.
    """

    record: int
    rig: int
    excitation: int
    sensors: int
    present: tuple[bool, ...]
    values: Mapping[str, Value]


def record_streams(
    plan: Plan, record: int
) -> tuple[np.random.Generator, np.random.Generator, np.random.Generator]:
    """The record's generators for draw, excitation and sensors, from ``SeedSequence(seed, spawn_key=(record,))``."""
    draw, excitation, sensors = np.random.SeedSequence(plan.seed, spawn_key=(record,)).spawn(3)
    return np.random.default_rng(draw), np.random.default_rng(excitation), np.random.default_rng(sensors)


def draws(plan: Plan, records: Iterable[int]) -> list[RecordDraw]:
    """What the records draw."""
    return [draw_at(plan, record, point_of(plan, record)) for record in records]


def dimension(plan: Plan) -> int:
    """Coordinates of a point: the choices, the shared quantities, then the longest of each of rigs, excitations, sensors."""
    return SETTINGS.choices + len(plan.shared) + sum(_blocks(plan))


def point_of(plan: Plan, record: int) -> NDArray[np.float64]:
    """The record's point ``(dimension,)`` in the unit cube."""
    if plan.sampling == "random":
        return record_streams(plan, record)[0].random(dimension(plan))
    if plan.sampling == "latin_hypercube":
        check_design(plan)
        return _hypercube(plan.records, dimension(plan), plan.seed)[record]
    block, place = divmod(record, SETTINGS.sobol_block)
    return _sobol(block, dimension(plan), plan.seed)[place]


def draw_at(plan: Plan, record: int, point: NDArray[np.float64]) -> RecordDraw:
    """What a record draws whose point ``(dimension,)`` is given."""
    shared = {
        name: quantity.at(float(u))
        for (name, quantity), u in zip(plan.shared.items(), point[SETTINGS.choices :], strict=False)
    }
    rig = pick(float(point[0]), [entry.weight for entry in plan.rigs])
    excitation = _fitting(plan, plan.excitations, rig, float(point[1]))
    sensors = _fitting(plan, plan.sensors, rig, float(point[2])) if plan.fitting(plan.sensors, rig) else -1
    at = SETTINGS.choices + len(plan.shared)
    rigs, excitations, _ = _blocks(plan)
    slots = iter(point[at:])
    present = tuple(
        element.probability == 1.0 or float(next(slots)) < element.probability
        for element in plan.rigs[rig].elements
    )
    values = {column: _value(quantity, slots, shared) for column, quantity, _ in plan.rigs[rig].quantities()}
    slots = iter(point[at + rigs :])
    for column, quantity in plan.excitations[excitation].quantities():
        values[column] = _value(quantity, slots, shared)
    if sensors >= 0:
        slots = iter(point[at + rigs + excitations :])
        for column, quantity, _ in plan.sensors[sensors].quantities():
            values[column] = _value(quantity, slots, shared)
    return RecordDraw(record, rig, excitation, sensors, present, values)


def median_draw(plan: Plan, rig: int, excitation: int, sensors: int) -> RecordDraw:
    """A draw with all elements of a rig and every quantity at its median, to try a plan with; record 0."""
    shared = {name: quantity.at(0.5) for name, quantity in plan.shared.items()}
    named = [(column, quantity) for column, quantity, _ in plan.rigs[rig].quantities()]
    named += list(plan.excitations[excitation].quantities())
    if sensors >= 0:
        named += [(column, quantity) for column, quantity, _ in plan.sensors[sensors].quantities()]
    values = {column: _value(quantity, repeat(0.5), shared) for column, quantity in named}
    return RecordDraw(0, rig, excitation, sensors, (True,) * len(plan.rigs[rig].elements), values)


def _blocks(plan: Plan) -> tuple[int, int, int]:
    """Coordinates that the longest of the rigs, excitations and sensors takes."""
    rigs = max(
        sum(element.probability < 1.0 for element in entry.elements)
        + _count(q for _, q, _ in entry.quantities())
        for entry in plan.rigs
    )
    excitations = max(_count(quantity for _, quantity in entry.quantities()) for entry in plan.excitations)
    sensors = max(
        (_count(quantity for _, quantity, _ in entry.quantities()) for entry in plan.sensors), default=0
    )
    return rigs, excitations, sensors


def _count(quantities: Iterable[Quantity]) -> int:
    return sum(isinstance(quantity, Distribution) for quantity in quantities)


def _fitting(plan: Plan, members: tuple, rig: int, u: float) -> int:
    indices = plan.fitting(members, rig)
    return indices[pick(u, [members[index].weight for index in indices])]


def _value(quantity: Quantity, slots: Iterator[float], shared: Mapping[str, Value]) -> Value:
    if isinstance(quantity, Distribution):
        return quantity.at(float(next(slots)))
    if isinstance(quantity, Shared):
        value = shared[quantity.name]
        return value if isinstance(value, str) or quantity.times == 1.0 else quantity.times * value
    return quantity


def check_design(plan: Plan) -> None:
    """Raise `ParameterError` where the points of a plan cannot be held."""
    records, size = plan.records, dimension(plan)
    if plan.sampling == "latin_hypercube" and records * size > SETTINGS.largest_hypercube:
        raise ParameterError(
            f"a Latin hypercube of {records} records in {size} quantities must be held whole in memory, and at most "
            f'{SETTINGS.largest_hypercube // size} records are allowed; use sampling = "sobol", which is made piece by piece'
        )


def _hypercube(records: int, size: int, seed: int) -> NDArray[np.float64]:
    with _designing:
        return _hypercube_of(records, size, seed)


@lru_cache(maxsize=1)
def _hypercube_of(records: int, size: int, seed: int) -> NDArray[np.float64]:
    from scipy.stats import qmc  # noqa: PLC0415  (half a second)

    points = qmc.LatinHypercube(size, rng=np.random.default_rng(seed)).random(records)
    points.flags.writeable = False
    return points


def _sobol(block: int, size: int, seed: int) -> NDArray[np.float64]:
    with _designing:
        return _sobol_of(block, size, seed)


@lru_cache(maxsize=4)
def _sobol_of(block: int, size: int, seed: int) -> NDArray[np.float64]:
    from scipy.stats import qmc  # noqa: PLC0415

    engine = qmc.Sobol(size, rng=np.random.default_rng(seed))
    if block:
        engine.fast_forward(block * SETTINGS.sobol_block)
    points = engine.random(SETTINGS.sobol_block)
    points.flags.writeable = False
    return points
