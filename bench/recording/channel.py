"""What a channel of a record is: name, unit, quantity, role and noise."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

from bench.errors import RecordingError, UnitError, UnknownNameError
from bench.recording.units import check_unit, conversion

ROLES = ("measured", "command", "prescribed", "")
"""What a channel is in its test: read by a sensor, sent to an actuator, imposed on the specimen, or not said."""


@dataclass(frozen=True)
class Channel:
    """One channel of a recording.

    Attributes:
        name: Name, unique in its recording; "time" is taken by the clock.
        unit: Unit of the values, as a pint expression ("N", "inch", "N m", "rad/s"); "1" for a pure number.
        quantity: One of `bench.recording.SI_UNITS` ("displacement", "force", …), which the unit must fit; "" for none.
        role: One of `ROLES`.
        noise_std: Standard deviation of the measurement noise [unit]; None where not known.

    Raises:
        RecordingError: Empty name, unknown role, or a noise that is negative or not finite.
        UnitError: Unknown unit, or one that does not fit the quantity.
        UnknownNameError: Unknown quantity.
    """

    name: str
    unit: str
    quantity: str = ""
    role: str = ""
    noise_std: float | None = None

    def __post_init__(self) -> None:
        if not isinstance(self.name, str) or not self.name.strip() or self.name == "time":
            raise RecordingError(
                f"a channel cannot be named {self.name!r}; give it a name of its own, other than 'time'"
            )
        if self.role not in ROLES:
            raise RecordingError(
                f"channel '{self.name}' has the role '{self.role}'; expected one of {', '.join(map(repr, ROLES))}"
            )
        if not isinstance(self.unit, str):
            raise UnitError(
                f"channel '{self.name}' has the unit {self.unit!r}; a text such as 'N' or '1' is expected"
            )
        object.__setattr__(self, "unit", self.unit.strip() or "1")
        try:
            check_unit(self.unit, self.quantity)
        except UnitError as error:
            raise UnitError(f"channel '{self.name}': {error}") from None
        if self.noise_std is not None:
            if not (math.isfinite(self.noise_std) and self.noise_std >= 0.0):
                raise RecordingError(
                    f"channel '{self.name}' has a noise_std of {self.noise_std}; a finite number >= 0 [{self.unit}] is expected"
                )
            object.__setattr__(self, "noise_std", float(self.noise_std))

    @property
    def label(self) -> str:
        """Name and unit as an axis of a plot shows them."""
        return f"{self.name} [{self.unit}]"

    def with_noise_times(self, factor: float) -> Channel:
        """The channel with its noise, where it is known, so many times as large."""
        return self if self.noise_std is None else replace(self, noise_std=factor * self.noise_std)

    def in_unit(self, unit: str) -> tuple[float, float, Channel]:
        """Slope and offset that take values to another unit, and the channel in it.

        Raises:
            UnitError: The unit is unknown, or of another dimension.
        """
        try:
            slope, offset = conversion(self.unit, unit)
        except UnitError as error:
            raise UnitError(f"channel '{self.name}': {error}") from None
        noise = None if self.noise_std is None else abs(slope) * self.noise_std
        return slope, offset, replace(self, unit=unit, noise_std=noise)


def channels_from(
    names: Iterable[str],
    *,
    units: Mapping[str, str],
    quantities: Mapping[str, str] | None = None,
    roles: Mapping[str, str] | None = None,
    noise_std: Mapping[str, float] | None = None,
    known: Mapping[str, Channel] | None = None,
) -> tuple[Channel, ...]:
    """Channels from mappings by name, as `Recording.from_arrays` takes them.

    Args:
        names: Names of the channels, in order.
        units: Unit of each.
        quantities: Quantity of some.
        roles: Role of some.
        noise_std: Noise of some [unit of the channel].
        known: Channels whose entries hold where the mappings say nothing.

    Raises:
        UnknownNameError: A mapping names a channel that is not among `names`.
        RecordingError: A channel has no unit, or as `Channel`.
        UnitError: As `Channel`.
    """
    names = tuple(names)
    for mapping in (units, quantities, roles, noise_std):
        for name in mapping or {}:
            if name not in names:
                raise UnknownNameError("channel", name, names)
    channels = []
    for name in names:
        base = known.get(name) if known else None
        if name not in units and base is None:
            raise RecordingError(
                f"channel '{name}' has no unit; give it one ('1' for a pure number): units={{'{name}': …}}, or --unit {name}=… on the "
                "command line"
            )
        entries: dict[str, Any] = {} if base is None else dict(base.__dict__)
        entries |= {"name": name, "unit": units.get(name, entries.get("unit"))}
        for key, mapping in (("quantity", quantities), ("role", roles), ("noise_std", noise_std)):
            if mapping and name in mapping:
                entries[key] = mapping[name]
        channels.append(Channel(**entries))
    return tuple(channels)
