"""What a campaign is: rigs, excitations and sensors to choose from, with distributions over their numbers.

Each record draws one rig, one excitation that fits it and one set of sensors, by weight, and a value for each of their
quantities. `bench.campaign.reading` makes a plan from TOML; `Plan.to_dict` gives it back.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from bench.campaign.alternatives import ExcitationPlan, RigPlan, SensorPlan, unique
from bench.campaign.distribution import Distribution, Quantity, Shared, check_weights
from bench.errors import ParameterError, UnknownNameError
from bench.signals.base import (
    BASE_SETTINGS,
)

Sampling = Literal["random", "latin_hypercube", "sobol"]
Precision = Literal["float32", "float64"]
Compression = Literal["none", "lz4", "zstd"]


@dataclass(frozen=True)
class PlanSettings:
    """Numbers of `bench.campaign.plan`."""

    rows_per_part: int = 500_000
    """Rows that a part aims at where the plan does not say: 14 MB for seven channels of float32."""
    min_parts: int = 64
    """Parts that a campaign is cut into where it has the records, so that many cores have work."""


SETTINGS = PlanSettings()


@dataclass(frozen=True)
class PlanLimits:
    """What a plan may ask for, whatever the machine.

    Attributes:
        records: Ten times the largest campaign that docs/scale.md reckons with, which fills the shared disks it names.
        samples: Samples of a record, those of any signal.
        parts: The manifest, with some 700 bytes for each, then stays within what a document may have.
    """

    records: int = 100_000_000
    samples: int = BASE_SETTINGS.max_samples
    parts: int = 40_000

    def exceeded(self, records: int, samples: float, parts: int) -> tuple[str, int, str] | None:
        """The first of the limits that a campaign exceeds: what is too many, how many it may be, what to do; None where it keeps all.

        Example:
            >>> PlanLimits().exceeded(10**9, 1000, 1000)[:2]
            ('records', 100000000)
        """
        for what, value, most, todo in (
            ("records", records, self.records, "make several campaigns, each with a seed of its own"),
            ("samples a record", samples, self.samples, "shorten the records, or lower the sample rate"),
            ("parts", parts, self.parts, "raise records_per_part"),
        ):
            if value > most:
                return what, most, todo
        return None


PLAN_LIMITS = PlanLimits()


@dataclass(frozen=True)
class Plan:
    """A campaign.

    Attributes:
        name: Name.
        records: Number of records.
        duration: Length of a record [s].
        sample_rate: Rate of the records [Hz]; must divide the rigs' step rates.
        seed: Entropy of all draws; record k uses ``SeedSequence(seed, spawn_key=(k,))``.
        rigs: Rigs to choose from.
        excitations: Excitations to choose from.
        sensors: Sets of sensors to choose from; true values where empty.
        shared: Quantities that others may refer to.
        channels: Channels kept; all commands driven and all sensors of the rigs where empty.
        sampling: How the quantities cover their distributions: independent random numbers, or a design over all records.
        drive_rate: Rate of the excitation [Hz], held between samples; `sample_rate` where None.
        precision: Type of the channels in the data set.
        compression: Of the data set, byte streams split first. Measured on five channels of a driven gap in float32,
            "zstd" (level 1) makes the files a fifth smaller and costs no more time than writing without.
        records_per_part: Records of one part (file); part of the plan because the bytes depend on it.
    """

    name: str
    records: int
    duration: float
    sample_rate: float
    rigs: tuple[RigPlan, ...]
    excitations: tuple[ExcitationPlan, ...]
    sensors: tuple[SensorPlan, ...] = ()
    shared: Mapping[str, Distribution] = field(default_factory=dict)
    seed: int = 0
    channels: tuple[str, ...] = ()
    sampling: Sampling = "random"
    drive_rate: float | None = None
    precision: Precision = "float32"
    compression: Compression = "zstd"
    records_per_part: int = 0

    def __post_init__(self) -> None:
        for name, low in (("records", 1), ("seed", 0), ("records_per_part", 0)):
            value = getattr(self, name)
            if isinstance(value, bool) or not isinstance(value, int) or value < low:
                raise ParameterError(
                    f"{name} of the campaign is {value!r}; a whole number of at least {low} is expected"
                )
        for name in ("duration", "sample_rate", "drive_rate"):
            value = getattr(self, name)
            if value is None and name == "drive_rate":
                value = self.sample_rate
            if isinstance(value, bool | str | None) or not (math.isfinite(value) and value > 0.0):
                raise ParameterError(f"{name} of the campaign is {value!r}; a positive number is expected")
        self._check_size(PLAN_LIMITS)
        if (
            abs(self.duration * self.sample_rate - self.n_samples) > 1e-6 * self.n_samples
            or self.n_samples < 2
        ):
            raise ParameterError(
                f"{self.duration:g} s at {self.sample_rate:g} Hz is not a whole number of samples (at least 2); "
                "change the duration or the sample rate"
            )
        self._check_members()
        if not self.records_per_part:
            whole = max(1, SETTINGS.rows_per_part // self.n_samples)
            object.__setattr__(
                self, "records_per_part", max(1, min(whole, -(-self.records // SETTINGS.min_parts)))
            )
            self._check_size(PLAN_LIMITS)

    def _check_size(self, limits: PlanLimits) -> None:
        samples = self.duration * self.sample_rate
        parts = -(-self.records // self.records_per_part) if self.records_per_part else 0
        exceeded = limits.exceeded(self.records, samples, parts)
        if exceeded is not None:
            what, most, todo = exceeded
            width = 4 if self.precision == "float32" else 8
            terabytes = min(self.records, 10**30) * samples * width / 1e12
            raise ParameterError(
                f"the campaign is too large: {_short(self.records)} records of {_short(samples)} samples are "
                f"{terabytes:.3g} TB a channel, and at most {most} {what} can be asked for; {todo}"
            )

    def _check_members(self) -> None:
        names = [rig.name for rig in self.rigs]
        for what, members in (
            ("rigs", self.rigs),
            ("excitations", self.excitations),
            ("sensors", self.sensors),
        ):
            unique(what, [member.name for member in members])
            if members:
                check_weights(what, [member.weight for member in members])
        for member in (*self.excitations, *self.sensors):
            for rig in member.rigs:
                if rig not in names:
                    raise UnknownNameError(f"rig of '{member.name}'", rig, names)
        for index, rig in enumerate(self.rigs):
            if not self.fitting(self.excitations, index):
                raise ParameterError(
                    f"no excitation fits rig '{rig.name}'; leave `rigs` out of one, or name the rig in it"
                )
        unique("channels", list(self.channels))
        for quantity in self.all_quantities():
            if isinstance(quantity, Shared) and quantity.name not in self.shared:
                raise UnknownNameError("shared quantity", quantity.name, self.shared)

    def all_quantities(self) -> Iterator[Quantity]:
        """Every quantity of every rig, excitation and set of sensors."""
        for rig in self.rigs:
            yield from (quantity for _, quantity, _ in rig.quantities())
        for excitation in self.excitations:
            yield from (quantity for _, quantity in excitation.quantities())
        for sensors in self.sensors:
            yield from (quantity for _, quantity, _ in sensors.quantities())

    def fitting(self, members: tuple[Any, ...], rig: int) -> list[int]:
        """Indices of the excitations or sensors that fit the rig."""
        name = self.rigs[rig].name
        return [i for i, member in enumerate(members) if not member.rigs or name in member.rigs]

    @property
    def n_samples(self) -> int:
        """Samples a record."""
        return round(self.duration * self.sample_rate)

    @property
    def n_parts(self) -> int:
        """Parts of the data set."""
        return -(-self.records // self.records_per_part)

    @property
    def withholds(self) -> bool:
        """Whether anything is withheld."""
        return any(rig.withheld for rig in self.rigs) or any(sensors.withheld for sensors in self.sensors)

    def part(self, index: int) -> range:
        """Records of a part."""
        return range(index * self.records_per_part, min((index + 1) * self.records_per_part, self.records))

    def to_dict(self, *, public: bool = False) -> dict[str, Any]:
        """The plan as in its file, all defaults written out; without what is withheld (and the seed) if `public`."""
        hidden = public and self.withholds
        entry: dict[str, Any] = {"name": self.name} | ({} if hidden else {"seed": self.seed})
        for name in (
            "records", "duration", "sample_rate", "drive_rate", "sampling", "precision", "compression", "records_per_part"
        ):  # fmt: skip
            if getattr(self, name) is not None:
                entry[name] = getattr(self, name)
        entry["channels"] = list(self.channels)
        if self.shared and not hidden:
            entry["shared"] = {name: value.to_dict() for name, value in self.shared.items()}
        entry["rigs"] = [rig.to_dict(public=public) for rig in self.rigs]
        entry["excitations"] = [excitation.to_dict() for excitation in self.excitations]
        entry["sensors"] = [sensors.to_dict(public=public) for sensors in self.sensors]
        return entry

    @property
    def sha256(self) -> str:
        """Hash of the whole plan; together with the versions of the software it stands for the bytes of the data set."""
        text = json.dumps(self.to_dict(), sort_keys=True, ensure_ascii=False)
        return hashlib.sha256(text.encode()).hexdigest()


def _short(number: float) -> str:
    """A number on a few characters, whatever its size."""
    if isinstance(number, int) and number.bit_length() > 64:
        return f"about 10^{math.floor(number.bit_length() * math.log10(2.0))}"
    return f"{number:,}".replace(",", " ") if isinstance(number, int) else f"{number:g}"
