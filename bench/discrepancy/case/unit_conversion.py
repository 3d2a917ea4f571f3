"""Units of a case converted to those of its model, or refused with the entry to change.

What a number is measured in is known twice: from the unit that ``nominal.json`` declares, and from what the number belongs to in the
model (`Expectation`). Where the two are of one dimension the numbers are converted, in words that fit the quantity: "g" of an
acceleration is no gram, "lb" of a force no mass. Where they are not, no fit could repair it, and the case is refused.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from bench.discrepancy.case.case import Case, CaseChannel, CaseRecord, NominalParameter
from bench.errors import UnitError
from bench.recording.units import conversion, read_as


@dataclass(frozen=True)
class Expectation:
    """What a channel or parameter of a case is measured in, by its model.

    Attributes:
        units: SI units that fit; the first is the model's own.
        reason: What in the model says so ("joint 'hinge' turns").
    """

    units: tuple[str, ...]
    reason: str


@dataclass(frozen=True)
class Conversion:
    """A conversion: from the unit declared to the one that the model has.

    Attributes:
        declared: Unit as declared.
        unit: Unit of the model.
        factor: Multiple.
    """

    declared: str
    unit: str
    factor: float


def conversion_of(kind: str, name: str, unit: str, expected: Expectation) -> Conversion:
    """The conversion of one entry.

    Args:
        kind: "channel" or "parameter".
        name: Its name.
        unit: Unit declared; empty for none, which is taken as the model's own.
        expected: What the model says.

    Raises:
        UnitError: The unit is unknown or of another dimension.
    """
    own = expected.units[0]
    if not unit:
        return Conversion(own, own, 1.0)
    try:
        read, target = read_as(unit, expected.units)
        factor, offset = conversion(read, target)
    except UnitError as error:
        unknown = f" ({error})" if str(error).startswith("unknown unit") else ""
        raise UnitError(
            f'nominal.json, {kind}s, "{name}": the unit is "{unit}", but {expected.reason}: "{own}" or a unit of the same dimension '
            f"is expected{unknown}; {_remedy(kind, unit, own)}"
        ) from None
    if offset != 0.0:
        raise UnitError(
            f'nominal.json, {kind}s, "{name}": "{unit}" has a zero of its own; convert the numbers to "{own}"'
        )
    return Conversion(unit, target, factor)


def _remedy(kind: str, unit: str, own: str) -> str:
    if kind == "channel" and unit in {"A", "mA", "V", "mV"} and own in {"N", "N m"}:
        return (
            f'multiply the column by the constant of the motor or sensor [{own}/{unit}] and write "unit": "{own}", '
            "or give the actuator of the model a gear or gain that is this constant"
        )
    if unit in {"kg", "g"} and own in {"N", "N m"}:
        return f'a load cell that shows {unit} reads "{unit}f": write that, or convert the numbers to {own}'
    what = "the column" if kind == "channel" else "value and std"
    return f'write "unit": "{own}" if {what} is in that unit already, or convert {what}'


def converted(
    case: Case, channels: Mapping[str, Expectation], parameters: Mapping[str, Expectation]
) -> tuple[Case, tuple[str, ...]]:
    """A case whose channels and parameters are in the units of its model, and what was converted, in words.

    Args:
        case: As declared.
        channels: What the model says of channels, by name; others stay as they are.
        parameters: Likewise of parameters.

    Raises:
        UnitError: A declared unit is unknown, or of another dimension than the model says.
    """
    by_channel = {
        c.name: conversion_of("channel", c.name, c.unit, channels[c.name])
        for c in case.channels
        if c.name in channels
    }
    by_parameter = {
        p.name: conversion_of("parameter", p.name, p.unit, parameters[p.name])
        for p in case.parameters
        if p.name in parameters
    }
    said = tuple(
        f"'{name}' is in {done.declared}; converted to {done.unit} (times {done.factor:.6g})"
        for name, done in (by_channel | by_parameter).items()
        if done.factor != 1.0
    )
    if all(done.factor == 1.0 for done in (*by_channel.values(), *by_parameter.values())):
        return _labelled(case, by_channel, by_parameter), ()
    factors = {name: done.factor for name, done in by_channel.items() if done.factor != 1.0}
    scaled = _labelled(case, by_channel, by_parameter)
    return (
        replace(
            scaled,
            identification=tuple(_scaled(record, factors) for record in case.identification),
            validation=tuple(_scaled(record, factors) for record in case.validation),
        ),
        said,
    )


def _labelled(case: Case, channels: Mapping[str, Conversion], parameters: Mapping[str, Conversion]) -> Case:
    """The case with the units of the model, its numbers beside the records converted."""

    def channel(entry: CaseChannel) -> CaseChannel:
        done = channels.get(entry.name)
        if done is None:
            return entry
        noise = None if entry.noise_std is None else entry.noise_std * done.factor
        return replace(entry, unit=done.unit, noise_std=noise, resolution=entry.resolution * abs(done.factor))

    def parameter(entry: NominalParameter) -> NominalParameter:
        done = parameters.get(entry.name)
        if done is None:
            return entry
        each = entry.each if entry.factor > 1.0 else entry.each * done.factor
        return replace(
            entry, unit=done.unit, value=entry.value * done.factor, std=entry.std * done.factor, each=each
        )

    stated = dict(case.options)
    if isinstance(limits := stated.get("limits"), Mapping):
        factors = {name: abs(done.factor) for name, done in channels.items()}
        stated["limits"] = {name: most * factors.get(str(name), 1.0) for name, most in limits.items()}
    return replace(
        case,
        channels=tuple(channel(entry) for entry in case.channels),
        parameters=tuple(parameter(entry) for entry in case.parameters),
        options=stated,
    )


def _scaled(record: CaseRecord, factors: Mapping[str, float]) -> CaseRecord:
    values = dict(record.values)
    for name, factor in factors.items():
        if name in values:
            samples = np.asarray(values[name] * factor, dtype=np.float64)
            samples.setflags(write=False)
            values[name] = samples
    return replace(record, values=values)
