"""A case: what the nominal model claims, with its uncertainties, and the records that contradict it.

A case is a folder with ``nominal.json`` and records in any format that `bench.read_recording` reads. Records whose name begins with
``identification`` serve to find the effect, those beginning with ``validation`` to judge. ``nominal.json`` names the
rig, the sample rate, every nominal parameter with its one-sigma uncertainty and every channel with unit, noise and role.

What is known of the acquisition goes there too: ``"load_interpolation": "linear" | "band_limited" | "zero_order_hold"`` for the
loads between their samples, ``"starts_in_motion": ["validation", …]`` (or true, for all of them) for records that do not start at
rest, ``"periodic": ["identification_2", …]`` for records that are whole periods of a steady state, and
``"antialias": {"kind": "butterworth", "order": 4, "cutoff_hz": 300}`` at a response channel that was filtered on its way. Of the
first two, what is not stated is looked for in the records (`search.load_interpolation`, `checks.initial_motion`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bench.discrepancy.case.acquisition import INTERPOLATIONS, Antialias
from bench.errors import RecordingError, UnknownNameError
from bench.record_files.reading import Noted, on_one_clock
from bench.recording.outliers import bridged, outliers


@dataclass(frozen=True)
class CaseLimits:
    """Numbers of `bench.discrepancy.case.case`."""

    min_samples: int = 32
    """Shortest record that is accepted: two octaves of eight ordinates each; a servo at 10 Hz gives that in 3.2 s."""
    largest: float = 1e100
    """Largest value of a sample: its square over a power of the step is still a number."""


SETTINGS = CaseLimits()

ORDERS = ("position", "velocity", "acceleration")
"""Quantities of a motion, by order."""


@dataclass(frozen=True)
class NominalParameter:
    """A parameter of the nominal model.

    Attributes:
        name: Name in the rig ("mass", "joint_stiffness_axial", …).
        value: Nominal value.
        std: One-sigma uncertainty; zero where it is taken as exact.
        unit: Unit.
        alike: Type of the part that it belongs to, whose numbers are off together; "" where that is not stated.
        each: One-sigma scatter of the parts of that type about their common value; a factor where `factor` is one.
        factor: Where it is positive and known to within a factor, that factor, one sigma of its logarithm; `std` is then what that makes
            of it near its value. Else one.
    """

    name: str
    value: float
    std: float
    unit: str = ""
    alike: str = ""
    each: float = 0.0
    factor: float = 1.0

    @classmethod
    def within_factor(
        cls, name: str, value: float, factor: float, unit: str = "", alike: str = "", each: float = 0.0
    ) -> NominalParameter:
        """One that is known to within a factor."""
        return cls(name, value, value * math.log(factor), unit, alike, each, factor)

    @property
    def entry(self) -> dict[str, float | str]:
        """Its entry in ``nominal.json``."""
        known = {"std": self.std} if self.factor == 1.0 else {"factor": self.factor}
        of_type = {"alike": self.alike, "each": self.each} if self.alike else {}
        return {"value": self.value, **known, "unit": self.unit, **of_type}

    @property
    def own_std(self) -> float:
        """The part of its uncertainty that is its own: all of it, or the scatter of its type; of its logarithm where it has a factor."""
        own = self.each if self.alike else self.factor
        return math.log(own) if self.factor > 1.0 else self.each if self.alike else self.std

    @property
    def common_std(self) -> float:
        """The part that it has in common with the others of its type; the two add in quadrature."""
        whole = math.log(self.factor) if self.factor > 1.0 else self.std
        return math.sqrt(whole**2 - self.own_std**2) if self.alike else 0.0


@dataclass(frozen=True)
class CaseChannel:
    """A channel of the records.

    Attributes:
        name: Column name.
        unit: Unit.
        role: A measured load, a commanded load ("command"), a "prescribed" motion, a "response", or "scheduling", what
            laws may depend on besides.
        noise_std: One-sigma noise; None where it is not stated.
        antialias: Filter that a response passed before it was sampled; None where there was none, or the loads passed it too.
        target: Entry of the user's own MJCF that it stands for: "sensor:NAME", "joint:NAME" or "actuator:NAME"; found by
            the channel's own name where empty.
        quantity: "position", "velocity" or "acceleration" of a joint.
        side: "motor" or "link": where the encoder of a joint with a gear sits.
        resolution: Step of the encoder; zero where it is not stated.
    """

    name: str
    unit: str = ""
    role: str = "response"
    noise_std: float | None = None
    antialias: Antialias | None = None
    target: str = ""
    quantity: str = ""
    side: str = ""
    resolution: float = 0.0


@dataclass(frozen=True)
class CaseRecord:
    """One record on a uniform clock.

    Attributes:
        name: File name without suffix.
        step: Time between samples [s].
        start: Time of the first sample [s].
        values: Channel name to samples (n,).
        at_rest: Whether the record starts at rest.
        periodic: Whether it is a whole period of a steady state (or several), its end joining its start; simulations of it are
            then run in from rest over so many periods that nothing is left of the start.
        notes: What was assumed, repaired or is doubtful in its file and clock, a sentence each.
        bridged: Samples that were never measured, in some channel, and interpolated: no fit is held against them.
    """

    name: str
    step: float
    start: float
    values: Mapping[str, NDArray[np.float64]]
    at_rest: bool = True
    periodic: bool = False
    notes: tuple[str, ...] = ()
    bridged: tuple[int, ...] = ()

    def __len__(self) -> int:
        return len(next(iter(self.values.values())))

    @property
    def time(self) -> NDArray[np.float64]:
        """Sample times (n,) [s]."""
        return np.asarray(self.start + self.step * np.arange(len(self)), dtype=np.float64)


def beginning(record: CaseRecord, samples: int, *, first: int = 0) -> CaseRecord:
    """Some samples of a record, its first ones unless told otherwise.

    Args:
        record: The record; a periodic one is no longer periodic then, and starts in motion.
        samples: Their number.
        first: The sample that they begin with.

    Returns:
        The record itself where it holds no more.
    """
    last = first + samples
    if first == 0 and last >= len(record):
        return record
    return replace(
        record,
        start=record.start + first * record.step,
        values={name: values[first:last] for name, values in record.values.items()},
        bridged=tuple(i - first for i in record.bridged if first <= i < last),
        periodic=False,
        at_rest=record.at_rest and not record.periodic,
    )


Prediction = Callable[[CaseRecord], Mapping[str, NDArray[np.float64]]]
"""What a model says of the channels of a record (n,), by name."""


@dataclass(frozen=True)
class Case:
    """A nominal model and the records it is held against.

    Attributes:
        name: Name of the case.
        rig: "sdof", "joint", "damper", or the path of an MJCF model.
        parameters: Nominal parameters.
        channels: Channels, without time.
        identification: Records for finding.
        validation: Records for judging.
        folder: Where it came from; None where it was built in memory.
        options: Further entries of ``nominal.json``, for rigs that need them.
    """

    name: str
    rig: str
    parameters: tuple[NominalParameter, ...]
    channels: tuple[CaseChannel, ...]
    identification: tuple[CaseRecord, ...]
    validation: tuple[CaseRecord, ...]
    folder: Path | None = None
    options: Mapping[str, object] = field(default_factory=dict)

    def channel(self, name: str) -> CaseChannel:
        """Return the channel called `name`.

        Raises:
            UnknownNameError: No such channel.
        """
        for channel in self.channels:
            if channel.name == name:
                return channel
        raise UnknownNameError("channel", name, (c.name for c in self.channels))

    @property
    def load_interpolation(self) -> str:
        """How the loads ran between their samples, one of `INTERPOLATIONS`; option "load_interpolation", "linear" without it.

        Raises:
            UnknownNameError: It is none of them.
        """
        chosen = str(self.options.get("load_interpolation", "linear"))
        if chosen not in INTERPOLATIONS:
            raise UnknownNameError("load_interpolation", chosen, INTERPOLATIONS)
        return chosen

    def has(self, name: str) -> bool:
        """Whether the case has a channel called `name`."""
        return any(channel.name == name for channel in self.channels)


def record_from_arrays(
    name: str,
    time: ArrayLike,
    values: Mapping[str, ArrayLike],
    *,
    at_rest: bool = True,
    periodic: bool = False,
    notes: Sequence[str] = (),
    asked: Collection[str] = (),
) -> CaseRecord:
    """Build a record on a uniform clock; the arrays are copied and made read-only.

    Clock and values are checked and mended as in every command (`bench.record_files.reading.on_one_clock`): a dropout of a few
    samples is bridged, jitter is interpolated away, and what was done stands in the record's notes.

    Args:
        name: Name of the record.
        time: Increasing sample times (n,) [s].
        values: Channel name to samples (n,).
        at_rest: Whether it starts at rest.
        periodic: Whether it is one or more whole periods of a steady state.
        notes: What is known of its file already.
        asked: Channels that hold what was asked for, see `outliers`.

    Raises:
        RecordingError: Too short, not uniform in time, longer dropouts, or channels of another length.
    """
    clock = np.asarray(time, dtype=float)
    if clock.ndim != 1 or len(clock) < SETTINGS.min_samples:
        raise RecordingError(
            f"record '{name}' has {clock.size} samples; at least {SETTINGS.min_samples} are needed: give a longer record"
        )
    _refuse_damaged(name, values)
    try:
        noted = on_one_clock(clock, {channel: np.asarray(v, dtype=float) for channel, v in values.items()})
    except RecordingError as error:
        raise RecordingError(f"record '{name}': {error}") from None
    planned = [c for c, channel in enumerate(values) if channel in asked]
    columns, odd, lost = {}, outliers(noted.values, asked=planned), set(_missing(clock, values, noted))
    more = []
    for channel, samples, runs in zip(values, noted.values.T, odd, strict=True):
        column = bridged(samples, runs)
        column.setflags(write=False)
        columns[channel] = column
        lost |= {k for run in runs for k in range(run.first, run.last + 1)}
        if runs:
            where = ", ".join(f"{noted.time[run.first]:.6g} s" for run in runs[:4])
            more.append(
                f"'{channel}' leaves its neighbours at {where}{' …' if len(runs) > 4 else ''} and comes back at once: outliers or "
                "dropouts of the logger, bridged and held against no model"
            )
    told = tuple(f"record '{name}': {note}" for note in (*notes, *noted.notes, *more))
    return CaseRecord(
        name,
        1.0 / noted.sample_rate,
        float(noted.time[0]),
        columns,
        at_rest,
        periodic,
        told,
        tuple(sorted(lost)),
    )


def _refuse_damaged(name: str, values: Mapping[str, ArrayLike]) -> None:
    for channel, samples in values.items():
        size = np.abs(np.asarray(samples, dtype=float))
        size[~np.isfinite(size)] = 0.0  # missing samples, which the clock deals with
        if size.max(initial=0.0) > SETTINGS.largest:
            raise RecordingError(
                f"record '{name}': '{channel}' holds {size.max():.3g} at sample {int(np.argmax(size))}, which no sensor reads: the file is "
                "damaged, or its columns are not those that nominal.json names"
            )


def _missing(clock: NDArray[np.float64], values: Mapping[str, ArrayLike], noted: Noted) -> list[int]:
    """Samples of the uniform clock that no sample of the record stands at, or one with a value that is not finite."""
    finite = np.all([np.isfinite(np.asarray(v, dtype=float)) for v in values.values()], axis=0)
    places = np.rint((clock[finite] - noted.time[0]) * noted.sample_rate).astype(np.int64)
    there = np.zeros(len(noted.time), dtype=bool)
    there[np.clip(places, 0, len(there) - 1)] = True
    return [int(k) for k in np.flatnonzero(~there)]
