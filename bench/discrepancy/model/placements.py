"""Placements: every effect of a catalogue at every place of a structure where it can sit."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from bench.discrepancy.case.case import Case
from bench.discrepancy.effects.effect import Effect
from bench.discrepancy.effects.where_prescribed import where_prescribed
from bench.discrepancy.model.placement import FROM, Placed
from bench.discrepancy.model.structure import Place, Structure

OTHER_AXIS = {
    "displacement": "rotation",
    "rotation": "displacement",
    "velocity": "angular_velocity",
    "angular_velocity": "velocity",
    "acceleration": "angular_acceleration",
    "angular_acceleration": "acceleration",
}
"""Channels of the joint rig that one sensor measures along its two axes."""


def placements(case: Case, structure: Structure, catalogue: Iterable[Effect]) -> list[Placed]:
    """Return every effect of a catalogue at every place of a structure where it can sit."""
    out: list[Placed] = []
    if case.rig == "damper":
        catalogue = where_prescribed(catalogue)
    for effect in catalogue:
        for place in structure.places:
            if (
                effect.site == "joint"
                and len(place.rows) == effect.n_coordinates
                and _finds_its_mass(structure, place, effect)
            ):
                out.append(Placed(effect, place))
            if len(place.rows) != 1:
                continue
            if effect.site == "read off":
                out.append(Placed(effect, place))
            out += [Placed(effect, place, target) for target in _targets(case, effect, structure, place)]
    return out


def _innermost(structure: Structure, place: Place, mass: str) -> bool:
    """Whether a place is the one where an inertia is asked for: of those that move it, the one that moves the fewest."""
    moved = [other for other in structure.places if len(other.rows) == 1 and mass in other.mass]
    return place is min(moved, key=lambda other: len(other.mass))


def _finds_its_mass(structure: Structure, place: Place, effect: Effect) -> bool:
    """Whether a place has what an effect carries, if it carries anything: a nominal mass whose position in the room is the coordinate."""
    if effect.carried is None:
        return True
    row = place.rows[0]
    masses = [
        structure.mass[structure.parameters.index(name)]
        for name in place.mass
        if name in structure.parameters
    ]
    return not structure.prescribed and any(
        np.allclose(m, np.max(np.abs(m)) * np.outer(row, row)) for m in masses
    )


def _targets(case: Case, effect: Effect, structure: Structure, place: Place) -> list[str]:
    if effect.site == "inertia":
        masses = [name for name in place.mass if _innermost(structure, place, name)]
        names = {"mass": masses, "stiffness": (place.stiffness,), "damping": (place.damping,)}[
            effect.quantity
        ]
        return [name for name in names if name in structure.parameters]
    dofs = np.abs(place.rows).sum(axis=0) > 0
    if effect.later:
        return list(structure.loads if effect.later < 0.0 else structure.channels)
    if effect.site == "actuator":
        loads = [name for name in structure.loads if effect.logged or case.channel(name).role == "command"]
        return [n for n in loads if np.abs(structure.inputs[dofs, structure.loads.index(n)]).sum() > 0]
    if effect.site == "sensor":
        order = {"position": 0, "velocity": 1, "acceleration": 2}[effect.quantity]
        channels = [
            o.channel for o in structure.observers if o.order == order and np.abs(o.row[dofs]).sum() > 0
        ]
        return _pickups(case, structure, channels) if effect.pickup else channels
    return []


def _pickups(case: Case, structure: Structure, channels: Sequence[str]) -> list[str]:
    """Cross-talk into response channels: from the loads on their structure, and from the same sensor's other axis."""
    out = []
    for channel in channels:
        kind, _, number = channel.rpartition("_")
        across = f"{OTHER_AXIS[kind]}_{number}" if kind in OTHER_AXIS else ""
        sources = [*structure.loads, across] if case.has(across) else structure.loads
        out += [f"{channel}{FROM}{source}" for source in sources]
    return out
