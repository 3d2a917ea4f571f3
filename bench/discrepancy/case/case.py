"""A case: what the nominal model claims, with its uncertainties, and the records that contradict it.

A case is a folder with ``nominal.json`` and records as ``.csv`` or ``.csv.gz``. Records whose name begins with
``identification`` serve to find the effect, those beginning with ``validation`` to judge. ``nominal.json`` names the
rig, the sample rate, every nominal parameter with its one-sigma uncertainty and every channel with unit, noise and role.

What is known of the acquisition goes there too: ``"load_interpolation": "linear" | "band_limited" | "zero_order_hold"`` for the
loads between their samples, ``"starts_in_motion": ["validation", …]`` (or true, for all of them) for records that do not start at
rest, ``"periodic": ["identification_2", …]`` for records that are whole periods of a steady state, and
``"antialias": {"kind": "butterworth", "order": 4, "cutoff_hz": 300}`` at a response channel that was filtered on its way. Of the
first two, what is not stated is looked for in the records (`between_samples`, `moving_starts`).
"""

from __future__ import annotations

import gzip
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bench.discrepancy.case.acquisition import INTERPOLATIONS, Antialias
from bench.discrepancy.case.elements import declared_parameters
from bench.discrepancy.case.schema import NominalDocument
from bench.errors import FileFormatError, RecordingError, UnknownNameError

NO_LOAD = "no load"
"""Channel of a load that is zero throughout, of a model of the user's own that nothing drives."""
SUFFIXES = (".csv", ".csv.gz")
MIN_SAMPLES = 200
"""Shortest record that is accepted; below it no spectrum, and so no statement about noise, is possible."""


@dataclass(frozen=True)
class NominalParameter:
    """A parameter of the nominal model.

    Attributes:
        name: Name in the rig ("mass", "joint_stiffness_axial", …).
        value: Nominal value.
        std: One-sigma uncertainty; zero where it is taken as exact.
        unit: Unit.
    """

    name: str
    value: float
    std: float
    unit: str = ""


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
    """

    name: str
    unit: str = ""
    role: str = "response"
    noise_std: float | None = None
    antialias: Antialias | None = None
    target: str = ""
    quantity: str = ""


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
    """

    name: str
    step: float
    start: float
    values: Mapping[str, NDArray[np.float64]]
    at_rest: bool = True
    periodic: bool = False

    def __len__(self) -> int:
        return len(next(iter(self.values.values())))

    @property
    def time(self) -> NDArray[np.float64]:
        """Sample times (n,) [s]."""
        return np.asarray(self.start + self.step * np.arange(len(self)), dtype=np.float64)


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
) -> CaseRecord:
    """Build a record; the arrays are copied and made read-only.

    Args:
        name: Name of the record.
        time: Uniform, increasing sample times (n,) [s].
        values: Channel name to samples (n,).
        at_rest: Whether it starts at rest.
        periodic: Whether it is one or more whole periods of a steady state.

    Raises:
        RecordingError: Too short, not uniform in time, NaN, or channels of another length.
    """
    clock = np.array(time, dtype=float)
    if clock.ndim != 1 or len(clock) < MIN_SAMPLES:
        raise RecordingError(
            f"record '{name}' has {clock.size} samples; at least {MIN_SAMPLES} are needed: give a longer record"
        )
    if not np.isfinite(clock).all():
        raise RecordingError(
            f"record '{name}': the time column is not finite in row {int(np.argmax(~np.isfinite(clock))) + 1}; repair it"
        )
    steps = np.diff(clock)
    step = float(np.median(steps))
    # A CSV clock is rounded to its printed digits, so single steps may be off by half a digit, but not by half a step.
    if step <= 0 or np.max(np.abs(clock - clock[0] - step * np.arange(len(clock)))) > 0.5 * step:
        step = float((clock[-1] - clock[0]) / (len(clock) - 1))
        if step <= 0 or np.max(np.abs(clock - clock[0] - step * np.arange(len(clock)))) > 0.5 * step:
            raise RecordingError(
                f"record '{name}': the time column is not uniform (steps from {steps.min():g} to {steps.max():g} s); "
                "resample it to a uniform clock"
            )
    columns = {}
    for channel, samples in values.items():
        column = np.array(samples, dtype=float)
        if column.shape != clock.shape:
            raise RecordingError(
                f"record '{name}': channel '{channel}' has {column.size} samples, time has {clock.size}"
            )
        if not np.isfinite(column).all():
            where = clock[int(np.argmax(~np.isfinite(column)))]
            raise RecordingError(
                f"record '{name}': channel '{channel}' is not finite at t = {where:g} s; cut or repair it"
            )
        column.setflags(write=False)
        columns[channel] = column
    return CaseRecord(name, step, float(clock[0]), columns, at_rest, periodic)


def read_case(folder: str | Path) -> Case:
    """Read a case folder.

    Args:
        folder: Folder with ``nominal.json`` and the records.

    Raises:
        FileFormatError: A file is missing or malformed.
        DocumentError: ``nominal.json`` has an entry that is not known, missing, of the wrong kind or out of range.
        RecordingError: A record cannot be used.
    """
    folder = Path(folder)
    path = folder / "nominal.json"
    if not folder.is_dir():
        raise FileFormatError(
            f"'{folder}' is no folder; give the folder that holds nominal.json and the records"
        )
    if not path.is_file():
        raise FileFormatError(f"no nominal.json in '{folder}'; a case folder needs one beside its records")
    nominal = NominalDocument.read(path)
    parameters = tuple(
        NominalParameter(name, entry.value, entry.std, entry.unit)
        for name, entry in nominal.parameters.items()
    )
    declared = declared_parameters(nominal.elements, path)
    parameters += tuple(NominalParameter(name, *entry) for name, entry in declared.items())
    channels = tuple(
        CaseChannel(
            name, entry.unit, nominal.role_of(name), entry.noise_std, entry.filter(), entry.target, entry.quantity or ""
        )
        for name, entry in nominal.channels.items()
        if name != "time"
    )  # fmt: skip
    moving = nominal.starts_in_motion
    in_motion = set(moving) if isinstance(moving, tuple) else set()
    periodic = set(nominal.periodic)
    groups: dict[str, list[CaseRecord]] = {"identification": [], "validation": []}
    for file in sorted(folder.iterdir()):
        stem = next((file.name.removesuffix(s) for s in SUFFIXES if file.name.endswith(s)), None)
        if stem is None:
            continue
        for group, records in groups.items():
            if stem.startswith(group):
                record = _read_record(
                    file, stem, channels, nominal.sample_rate_hz, moving is not True and stem not in in_motion
                )
                records.append(replace(record, periodic=stem in periodic))
    for group, records in groups.items():
        if not records:
            raise FileFormatError(f"no {group}*.csv or .csv.gz in '{folder}'; at least one is needed")
    have = [record.name for records in groups.values() for record in records]
    for name in sorted(periodic.union(in_motion, *(c.antialias.records for c in channels if c.antialias))):
        if name not in have:
            raise UnknownNameError("record", name, have)
    case = Case(
        folder.name, nominal.rig, parameters, channels,
        tuple(groups["identification"]), tuple(groups["validation"]), folder, nominal.options,
    )  # fmt: skip
    return without_load(case)


def without_load(case: Case) -> Case:
    """A case with a load that is zero throughout, where it has none and starts in motion: a free decay."""
    own = {"sdof": "force"}.get(case.rig, NO_LOAD)
    driven = any(
        c.role in {"measured", "command", "prescribed"} or c.target.startswith("actuator:")
        for c in case.channels
    )
    records = (*case.identification, *case.validation)
    if driven or case.rig in {"damper", "joint"} or any(record.at_rest for record in records):
        return case

    def still(record: CaseRecord) -> CaseRecord:
        zeros = np.zeros(len(record))
        zeros.setflags(write=False)
        return replace(record, values={**record.values, own: zeros})

    channel = CaseChannel(own, "" if own == NO_LOAD else "N", "measured", 0.0)
    identification, validation = (
        tuple(map(still, group)) for group in (case.identification, case.validation)
    )
    return replace(
        case, channels=(*case.channels, channel), identification=identification, validation=validation
    )


def _check_header(file: Path, names: list[str], channels: tuple[CaseChannel, ...]) -> None:
    missing = [c.name for c in channels if c.name not in names]
    if missing:
        hint = " (columns are separated by commas)" if len(names) == 1 else ""
        raise FileFormatError(
            f"'{file}' lacks the column(s) {', '.join(missing)}; its header is '{','.join(names)}'{hint}"
        )
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise FileFormatError(
            f"'{file}' names the column '{twice}' twice; give every column one name of its own"
        )


def _read_record(
    file: Path, stem: str, channels: tuple[CaseChannel, ...], sample_rate: float | None, at_rest: bool
) -> CaseRecord:
    try:
        opener = gzip.open if file.suffix == ".gz" else open
        with opener(file, "rt", encoding="utf-8") as stream:
            names = [name.strip() for name in stream.readline().lstrip("#").split(",")]
            _check_header(file, names, channels)
            lines = [line for line in stream if line.strip()]
            table = np.loadtxt(lines, delimiter=",", ndmin=2) if lines else np.zeros((0, len(names)))
    except (ValueError, OSError, EOFError, UnicodeDecodeError, zlib.error) as error:
        raise FileFormatError(f"'{file}' is no readable CSV table with a header line: {error}") from None
    if table.shape[1] != len(names):
        raise FileFormatError(
            f"'{file}' has {len(names)} names over {table.shape[1]} columns; give every column one name of its own"
        )
    columns = {name: table[:, i] for i, name in enumerate(names) if i < table.shape[1]}
    if "time" in columns:
        time = columns["time"]
    elif sample_rate is not None:
        time = np.arange(len(table)) / sample_rate
    else:
        raise FileFormatError(
            f"'{file}' has no column 'time' and nominal.json no sample_rate_hz; one of them is needed"
        )
    return record_from_arrays(stem, time, {c.name: columns[c.name] for c in channels}, at_rest=at_rest)
