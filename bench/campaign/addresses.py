"""Where the channels of a rig come from."""

from __future__ import annotations

from typing import NamedTuple

from bench.rig import Rig


class Source(NamedTuple):
    """Where a channel comes from: a column of the controls or of the sensors, or an element's motion, force or state."""

    kind: str  # "command", "sensor", "displacement", "velocity", "force", "state"
    index: int
    item: int = -1


def sources_of(rig: Rig) -> dict[str, Source]:
    """Source of every channel of the rig, in the order of `rig.channels`."""
    built = rig.built
    sources = [Source("command", i) for i in range(len(built.actuators))]
    sources += [Source("sensor", i) for i in range(built.model.nsensordata)]
    for place, item in enumerate(built.placed):
        moving = range(len(item.element.joints))
        sources += [Source(kind, i, place) for kind in ("displacement", "velocity", "force") for i in moving]
        sources += [Source("state", i, place) for i in range(len(item.element.law.states))]
    return {channel.name: source for channel, source in zip(rig.channels, sources, strict=True)}
