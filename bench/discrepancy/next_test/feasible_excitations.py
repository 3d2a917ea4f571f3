"""Excitations that a rig can do: shapes over its loads, made as large as loads, stroke and velocity allow.

What a rig can do is read off its records unless ``nominal.json`` says more under ``"limits"``: the largest load of any record
is what its shaker gives; stroke and velocity may exceed the largest measured ones by half.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np

from bench.discrepancy.case.case import CaseRecord, record_from_arrays
from bench.discrepancy.likelihood.problem import Array
from bench.discrepancy.response.simulator import Simulator
from bench.signals import BandLimitedNoise, Harmonic, ImpulseTrain, Multisine, Signal, Sweep, Tapered

FreeRun = Callable[[CaseRecord], Array]


class RigLimits(NamedTuple):
    """What the rig can do.

    Attributes:
        load: Largest magnitude of every load channel.
        motion: Largest magnitude of every response channel.
    """

    load: Mapping[str, float]
    motion: Mapping[str, float]


class SizedExcitation(NamedTuple):
    """An excitation at a size that the rig can do.

    Attributes:
        label: What it is, in words.
        record: Its loads as a record, the responses zero.
        peaks: Largest magnitude of every load.
        motion: Largest magnitude of every response channel, the larger one of the rivals'.
    """

    label: str
    record: CaseRecord
    peaks: dict[str, float]
    motion: dict[str, float]


def limits_of(simulator: Simulator) -> RigLimits:
    """Limits of the rig: those stated in ``nominal.json``, those of the records where none are."""
    records = (*simulator.case.identification, *simulator.case.validation)
    stated = simulator.case.options.get("limits", {})
    given = {k: float(v) for k, v in stated.items()} if isinstance(stated, Mapping) else {}
    load = {
        name: given.get(name, max(float(np.abs(r.values[name]).max()) for r in records))
        for name in simulator.structure.loads
    }
    motion = {
        o.channel: given.get(
            o.channel,
            # an acceleration is limited by the load already, and friction makes its peaks erratic
            simulator.settings.next_test.reach
            * max(float(np.abs(r.values[o.channel]).max()) for r in records)
            if o.order < 2
            else np.inf,
        )
        for o in simulator.structure.observers
    }
    return RigLimits(load, motion)


def resonance(simulator: Simulator, load: int) -> float:
    """Frequency [Hz] at which a load moves the places of the rig most; that of the measured motion where nothing resonates."""
    step = simulator.records[0].step
    duration = max(len(r) for r in simulator.records) * step
    if simulator.driven:
        motion = simulator.motion(0)
        rate = float(np.std(motion.velocity) / np.std(motion.position) / (2.0 * np.pi))
        return float(np.clip(rate, 2.0 / duration, 0.1 / step))
    frequency = np.geomspace(2.0 / duration, 0.1 / step, 400)
    rows = np.vstack([p.rows for p in simulator.structure.places])
    linear = simulator.structure.at(simulator.nominal)
    omega = 2.0 * np.pi * frequency
    dynamic = (
        linear.stiffness[None]
        + 1j * omega[:, None, None] * linear.damping[None]
        - (omega**2)[:, None, None] * linear.mass[None]
    )
    position = np.linalg.solve(dynamic, np.broadcast_to(linear.inputs, (len(omega), *linear.inputs.shape)))
    response = np.abs(rows @ position)[:, :, load].max(axis=1)
    peak = int(np.argmax(response))
    if 0 < peak < len(frequency) - 1:
        return float(frequency[peak])
    motion = simulator.motion(0)
    rate = np.std(motion.velocity @ rows.T, axis=0) / np.maximum(
        np.std(motion.position @ rows.T, axis=0), 1e-300
    )
    return float(np.clip(np.median(rate) / (2.0 * np.pi), 4.0 / duration, 0.05 / step))


def band_about(centre: float) -> tuple[float, float]:
    """Lowest and highest frequency of what excites a resonance [Hz] and its surroundings."""
    return 0.2 * centre, 3.0 * centre


def shapes(centre: float, duration: float) -> list[tuple[str, Signal]]:
    """Signals around a resonance [Hz], with what they are in words."""
    slow, pulse, (low, high) = 0.2 * centre, 0.5 / centre, band_about(centre)
    return [
        (f"slow sine at {slow:.3g} Hz", Tapered(Harmonic(slow), fade_in=min(0.5 / slow, 0.9 * duration))),
        (
            f"sine at the resonance, {centre:.3g} Hz, growing from zero",
            Tapered(Harmonic(centre), fade_in=0.9 * duration),
        ),
        (f"sweep up from {0.3 * centre:.3g} to {2 * centre:.3g} Hz", Sweep(0.3 * centre, 2.0 * centre)),
        (f"sweep down from {2 * centre:.3g} to {0.3 * centre:.3g} Hz", Sweep(2.0 * centre, 0.3 * centre)),
        (
            f"multisine from {low:.3g} to {high:.3g} Hz",
            Multisine(band=(low, high), phases="schroeder"),
        ),
        (f"noise below {1.5 * centre:.3g} Hz", BandLimitedNoise(cutoff=1.5 * centre)),
        (
            f"half-sine pulses of {pulse:.3g} s and of either sign",
            ImpulseTrain(width=pulse, interval=min(6.0 / centre, 0.25 * duration), alternate=True),
        ),
    ]


def candidates(simulator: Simulator, loads: Sequence[int], samples: int) -> list[tuple[str, Array]]:
    """Unit-peak loads (samples, n_loads) over single loads and over all of them, with what they are in words."""
    step = simulator.records[0].step
    names = simulator.structure.loads
    sets = [
        s for size in range(1, len(loads) + 1) for s in combinations(loads, size) if size in {1, len(loads)}
    ]
    out = []
    for chosen in sets:
        lists = [shapes(resonance(simulator, j), samples * step) for j in chosen]
        for entries in zip(*lists, strict=True):
            columns = np.zeros((samples, len(names)))
            for i, (j, (_, signal)) in enumerate(zip(chosen, entries, strict=True)):
                x = signal.sample(samples, 1.0 / step, np.random.default_rng(j))
                # alike, two loads would be one: the second is turned round in time
                columns[:, j] = (x[::-1] if i % 2 else x) / max(float(np.abs(x).max()), 1e-300)
            label = entries[0][0]
            if len(names) > 1:
                label += " on " + " and ".join(names[j] for j in chosen)
            out.append((label, columns))
    return out


def scaled_to_limits(
    simulator: Simulator, label: str, columns: Array, limits: RigLimits, simulate: Sequence[FreeRun]
) -> tuple[SizedExcitation, list[Array]] | None:
    """Scale loads of unit peak to the limits of the rig under every rival.

    Args:
        simulator: Records and structure.
        label: What it is in words.
        columns: (n, n_loads) of unit peak.
        limits: The limits.
        simulate: Response (n, n_channels) of every rival to a record.

    Returns:
        The proposal and the rivals' responses; None where a rival diverges or cannot be kept within the limits.
    """
    settings = simulator.settings.next_test
    names = simulator.structure.loads
    bounds = np.array([limits.motion[name] for name in simulator.structure.channels])
    full = columns * np.array([limits.load[name] for name in names])
    step = simulator.records[0].step
    time = step * np.arange(len(columns))
    zeros = dict.fromkeys(simulator.structure.channels, np.zeros(len(columns)))
    scale = 1.0
    for _ in range(settings.scalings):
        loads = {name: scale * full[:, j] for j, name in enumerate(names)}
        record = record_from_arrays(f"proposed: {label}", time, {**zeros, **loads})
        responses = [run(record) for run in simulate]
        if not all(np.isfinite(r).all() for r in responses):
            scale *= 0.5
            continue
        largest = np.max([np.abs(r).max(axis=0) for r in responses], axis=0)
        ratio = float(np.max(largest / bounds))
        if ratio <= 1.0:
            peaks = {name: float(np.abs(loads[name]).max()) for name in names}
            motion = dict(zip(simulator.structure.channels, (float(x) for x in largest), strict=True))
            return SizedExcitation(label, record, peaks, motion), responses
        scale *= float(np.clip(settings.margin / ratio, 0.2, settings.margin))
    return None
