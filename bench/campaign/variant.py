"""A rig of a plan, compiled once; what changes from record to record is written into the fields of a native batch."""

from __future__ import annotations

import threading
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from mujoco.batch import Batch
from numpy.typing import NDArray

from bench import native
from bench.campaign.addresses import Source, sources_of
from bench.campaign.alternatives import ElementPlan, RigPlan
from bench.campaign.distribution import Value
from bench.campaign.drawing import RecordDraw
from bench.campaign.nest import filled
from bench.campaign.plan import Plan
from bench.errors import ParameterError, UnknownNameError
from bench.laws.along import force_along
from bench.measurement import Chain, Stage
from bench.recording import Channel
from bench.rig import Element, Rig
from bench.rig.configuration import rig_from_configuration
from bench.rig.drives import Initial, controls_of
from bench.rig.library import PRESCRIBED_ACTUATORS, prescribe, starting
from bench.rig.structure import Address, structure_address
from bench.signals import Excitation, Signal


@dataclass(frozen=True, eq=False)
class Variant:
    """A rig of a plan with some of its elements, compiled.

    Attributes:
        plan: Its description.
        elements: Descriptions of the elements that it has.
        rig: The rig, its laws at their defaults.
        structure: Address and column of each structural number that the plan names.
        sources: Source by channel.
    """

    plan: RigPlan
    elements: tuple[ElementPlan, ...]
    rig: Rig
    structure: tuple[tuple[Address, str], ...]
    sources: Mapping[str, Source] = field(repr=False)

    def thetas(self, values: Mapping[str, Value]) -> list[NDArray[np.float64]]:
        """Theta of each element.

        Raises:
            ParameterError: A value lies outside the bounds of its law.
        """
        return [
            present.law.theta(**{name: float(values[f"{entry.name}/{name}"]) for name in entry.parameters})
            for entry, present in zip(self.elements, self.rig.elements, strict=True)
        ]

    def with_values(self, values: Mapping[str, Value]) -> Rig:
        """The rig with a record's values, as a rig of its own."""
        rig = self.rig
        for element, theta in zip(self.rig.elements, self.thetas(values), strict=True):
            rig = rig.with_element(element.with_(theta=theta))
        for kind, target, _ in self.plan.structure:
            rig = rig.with_structure(**{kind: {target: float(values[f"structure/{kind}/{target}"])}})
        return rig

    def fill(
        self,
        batch: Batch,
        thetas: list[list[NDArray[np.float64]]],
        draws: list[RecordDraw],
        starts: list[Mapping[str, tuple[float, float]]],
    ) -> None:
        """Write the values of every simulation into the batch, and where it starts."""
        for simulation, start in enumerate(starts):
            for joint, (position, velocity) in start.items():
                at_q, at_v, _ = native.coordinate(self.rig.model, joint).terms[0]
                batch.bind("qpos")[simulation, at_q] = position
                batch.bind("qvel")[simulation, at_v] = velocity
        for place, item in enumerate(self.rig.built.placed):
            columns = np.array([theta[place] for theta in thetas])
            if item.theta >= 0:
                batch.expand("numeric_data")[:, item.theta : item.theta + columns.shape[1]] = columns
            else:
                address = self._friction(item.element)
                batch.expand(address.field)[:, address.index] = columns[:, 0]
            if item.act >= 0:
                start = item.element.law.start()
                batch.bind("act")[:, item.act : item.act + len(start)] = start
        for address, column in self.structure:
            values = np.array([draw.values[column] for draw in draws], dtype=float)
            address.write_each(batch.expand(address.field), values)
        if self.structure:
            batch.set_const()

    def _friction(self, element: Element) -> Address:
        return structure_address(self.rig.model, "frictionloss", element.joints[0])

    def check_structure(self, values: Mapping[str, Value]) -> None:
        """Raise `ParameterError` where a structural number cannot be."""
        for _, column in self.structure:
            kind, value = column.split("/")[1], float(values[column])
            if (
                not np.isfinite(value)
                or (value < 0.0 and kind != "stiffness")
                or (value == 0.0 and kind == "mass")
            ):
                raise ParameterError(f"{column} is {value:g}; a finite, positive value is expected")

    def channel(
        self, name: str, index: int, rows: Rows, theta: list[NDArray[np.float64]]
    ) -> NDArray[np.float64]:
        """A channel of simulation `index` ``(n,)``."""
        source = self.sources[name]
        if source.kind == "command":
            return rows.controls[index, :: rows.stride, source.index]
        if source.kind == "sensor":
            return rows.sensors[index, :: rows.stride, source.index]
        item = self.rig.built.placed[source.item]
        model = self.rig.model
        nq, nv = model.nq, model.nv
        states = rows.states[index, :: rows.stride]
        qpos, qvel, act = states[:, 1 : 1 + nq], states[:, 1 + nq : 1 + nq + nv], states[:, 1 + nq + nv :]
        if source.kind == "state":
            return act[:, item.act + source.index]
        controls = rows.controls[index, :: rows.stride]
        if source.kind in {"displacement", "velocity"}:
            return item.coordinates[source.index].values(qpos, qvel, controls)[source.kind == "velocity"]
        pairs = [coordinate.values(qpos, qvel, controls) for coordinate in item.coordinates]
        q, v = (np.stack(part, axis=1) for part in zip(*pairs, strict=True))
        z = act[:, item.act : item.act + len(item.element.law.states)] if item.act >= 0 else act[:, :0]
        return force_along(item.element.law, theta[source.item], states[:, 0], q, v, z)[:, source.index]


class Rows(NamedTuple):
    """What a batch recorded, one row a step: ``(n_simulations, n, …)``; `states` is empty where no channel needs it."""

    controls: NDArray[np.float64]
    sensors: NDArray[np.float64]
    states: NDArray[np.float64]
    stride: int


class Variants:
    """The variants of a plan, each compiled when it is first asked for; safe to share between threads."""

    def __init__(self, plan: Plan) -> None:
        self.plan = plan
        self._known: dict[tuple[int, tuple[bool, ...]], Variant] = {}
        self._lock = threading.Lock()

    def of(self, rig: int, present: tuple[bool, ...]) -> Variant:
        """The variant of a rig with these of its elements.

        Raises:
            BenchError: As for `Rig.built`, or a name of the plan that the model lacks.
        """
        with self._lock:
            if (rig, present) not in self._known:
                self._known[rig, present] = _compiled(self.plan.rigs[rig], present)
            return self._known[rig, present]

    def full(self, rig: int) -> Variant:
        """The variant with all elements."""
        return self.of(rig, (True,) * len(self.plan.rigs[rig].elements))


def _compiled(entry: RigPlan, present: tuple[bool, ...]) -> Variant:
    settings = {
        key: getattr(entry, key) for key in ("timestep", "integrator") if getattr(entry, key) is not None
    }
    base = rig_from_configuration({"rig": entry.rig, **settings}, folder=entry.folder)
    if base.elements and not entry.elements:
        joint = base.elements[0]
        raise ParameterError(
            f"rig '{entry.name}' comes without elements; a plan lists them all: add [[rigs.elements]] with "
            f'law = "{joint.law.name}" and joints = {list(joint.joints)}'
        )
    kept = tuple(element for element, has in zip(entry.elements, present, strict=True) if has)
    elements = [
        Element.of(_law(item), *item.joints, inputs=item.inputs, name=item.name, exact=item.exact)
        for item in kept
    ]
    rig = base.with_(name=entry.name, elements=elements)
    structure = tuple(
        (structure_address(rig.model, kind, target), f"structure/{kind}/{target}")
        for kind, target, _ in entry.structure
    )
    return Variant(entry, kept, rig, structure, sources_of(rig))


def _law(item: ElementPlan):
    from bench.laws import find_law  # noqa: PLC0415

    return find_law(item.law, item.header)


def drawn_commands(
    plan: Plan, variant: Variant, draw: RecordDraw, rng: np.random.Generator
) -> tuple[dict[str, NDArray], Initial]:
    """The record's commands at the steps ``(n,)`` by actuator, and its start.

    Raises:
        ParameterError: The excitation does not fit the rig, or prescribes the motion of a mass that is drawn: the commands
            hold its inertia force.
    """
    entry = plan.excitations[draw.excitation]
    rig = variant.rig
    if not entry.prescribe:
        controls = controls_of(rig, excitation_of(plan, draw, plan.drive_rate or plan.sample_rate), rng)
        return dict(zip(rig.actuators, controls.T, strict=True)), {}
    if any(kind in {"mass", "inertia", "armature"} for kind, _, _ in variant.plan.structure):
        raise ParameterError(
            f"excitation '{entry.name}' prescribes a motion, and rig '{variant.plan.name}' changes the masses it moves; leave "
            "mass, inertia and armature out of its structure"
        )
    displacement = excitation_of(plan, draw, 1.0 / rig.timestep).sample(rng)[:, 0]
    start = starting(rig, displacement, joint=entry.prescribe)
    return dict(prescribe(rig, displacement, joint=entry.prescribe)), start


def excitation_of(plan: Plan, draw: RecordDraw, rate: float) -> Excitation:
    """The record's excitation, at a sample rate [Hz]."""
    entry = plan.excitations[draw.excitation]
    signals = {
        actuator: Signal.from_dict(filled(node, f"excitation/{actuator}", draw.values))
        for actuator, node in entry.signals.items()
    }
    return Excitation(signals, plan.duration, rate)


def chains_of(plan: Plan, draw: RecordDraw) -> dict[str, Chain]:
    """The record's measurement chain by channel."""
    if draw.sensors < 0:
        return {}
    return {
        channel: Chain(
            *(
                Stage.from_dict({"type": kind, **filled(node, f"sensors/{channel}/{kind}", draw.values)})
                for kind, node in stages.items()
            )
        )
        for channel, stages in plan.sensors[draw.sensors].chains.items()
    }


def kept_channels(plan: Plan, variants: Variants) -> tuple[Channel, ...]:
    """The channels of the data set, with units; one that only some rigs have is null for the others.

    Raises:
        UnknownNameError: A channel asked for is in none of the rigs.
        ParameterError: It belongs to a withheld element, or two rigs give it different units.
    """
    found: dict[str, Channel] = {}
    default: dict[str, None] = {}
    secret: set[str] = set()
    driven = {actuator for entry in plan.excitations for actuator in entry.signals}
    driven |= set(PRESCRIBED_ACTUATORS) if any(entry.prescribe for entry in plan.excitations) else set()
    for index in range(len(plan.rigs)):
        variant = variants.full(index)
        withheld = [i for i, entry in enumerate(variant.elements) if entry.withheld]
        for channel in variant.rig.channels:
            source = variant.sources[channel.name]
            if source.item in withheld and source.item >= 0:
                secret.add(channel.name)
            if found.setdefault(channel.name, channel).unit != channel.unit:
                raise ParameterError(
                    f"channel '{channel.name}' is in {found[channel.name].unit} for one rig and in {channel.unit} for "
                    f"'{plan.rigs[index].name}'; leave it out of `channels`, or make two campaigns"
                )
            if source.kind == "sensor" or (source.kind == "command" and channel.name in driven):
                default.setdefault(channel.name)
    names = plan.channels or tuple(default)
    for name in names:
        if name not in found:
            raise UnknownNameError("channel of the campaign's rigs", name, found)
        if name in secret:
            raise ParameterError(
                f"channel '{name}' belongs to a withheld element and would give it away; leave it out of `channels`"
            )
    return tuple(found[name] for name in names)
