"""Placements: every effect of a catalogue at every place of a structure where it can sit."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from bench.discrepancy.case.case import Case
from bench.discrepancy.effects.effect import Effect
from bench.discrepancy.model.placement import FROM, Placed
from bench.discrepancy.model.structure import Place, Structure

_AXES = (
    ("displacement", "rotation"),
    ("velocity", "angular_velocity"),
    ("acceleration", "angular_acceleration"),
)
OTHER_AXIS = {one: other for pair in _AXES for one, other in (pair, pair[::-1])}
"""Channels of the joint rig that one sensor measures along its two axes."""


def placements(case: Case, structure: Structure, catalogue: Iterable[Effect]) -> list[Placed]:
    """Return every effect of a catalogue at every place of a structure where it can sit."""
    out: list[Placed] = []
    for effect in catalogue:
        for place in structure.places:
            if effect.site == "joint" and len(place.rows) == effect.n_coordinates:
                out.append(Placed(effect, place))
            if len(place.rows) != 1:
                continue
            if effect.site == "read off":
                out.append(Placed(effect, place))
            out += [Placed(effect, place, target) for target in _targets(case, effect, structure, place)]
    return out


def _targets(case: Case, effect: Effect, structure: Structure, place: Place) -> list[str]:
    if effect.site == "inertia":
        names = {"mass": place.mass, "stiffness": (place.stiffness,), "damping": (place.damping,)}
        return [name for name in names[effect.quantity] if name in structure.parameters]
    dofs = np.any(place.rows, axis=0)
    if effect.site == "actuator":
        driven = np.any(structure.inputs[dofs], axis=0)
        loads = _loads(case, structure, effect.quantity or "command")
        return [name for name in loads if driven[structure.loads.index(name)]]
    if effect.site == "sensor":
        order = {"position": 0, "velocity": 1, "acceleration": 2}[effect.quantity]
        channels = [o.channel for o in structure.observers if o.order == order and np.any(o.row[dofs])]
        return _pickups(case, structure, channels) if effect.pickup else channels
    return []


def _loads(case: Case, structure: Structure, role: str) -> list[str]:
    """Loads of a role; measured ones that act and that two sensors answer: with one, its error is the inverse of that sensor's own."""
    loads = [name for name in structure.loads if case.channel(name).role == role]
    if role == "command":
        return loads
    told = len({observer.channel for observer in structure.observers}) > 1
    return [x for x in loads if told and any(np.any(record.values[x]) for record in case.identification)]


def _pickups(case: Case, structure: Structure, channels: Sequence[str]) -> list[str]:
    """Cross-talk into response channels: from the loads on their structure, and from the same sensor's other axis."""
    if case.rig == "damper":  # what the force channel picks up from the displacement is a stiffness
        return []
    out = []
    for channel in channels:
        kind, _, number = channel.rpartition("_")
        across = f"{OTHER_AXIS[kind]}_{number}" if kind in OTHER_AXIS else ""
        sources = [*structure.loads, across] if case.has(across) else structure.loads
        out += [f"{channel}{FROM}{source}" for source in sources]
    return out
