"""Sets of records of equal length that a joint may be learnt from: the dissertation's, and ones designed to cover states and memory.

The designed set begins with the record of the dissertation in which both axes are loaded. From it a joint with memory is learnt, quickly
and roughly, and with it in the joint's place the motions under many candidate loads are predicted. Of these those are taken, one
after the other, that add most to what has been covered (`bench.excitation.Coverage`). All sets stay within the same peak loads.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from bench.arrays import Array
from bench.excitation import Coverage
from bench.identification.memory import fit_memory
from bench.reproduction import laboratory
from bench.reproduction.joint_models import LOADINGS
from bench.rig import Element, Rig, simulate
from bench.signals import BandLimitedNoise, Concatenation, Constant, Excitation, Record, Signal, Tapered
from memory.row import Progress


@dataclass(frozen=True)
class RecordSetSettings:
    """Numbers of `memory.record_sets`.

    Attributes:
        seconds: Length of a record [s]; a set has three. A third of the dissertation's: with 90 s every set visits much.
        pieces: Pieces of a designed record, each of a load of its own.
        candidates: Loads that pieces are chosen from.
        levels: Least and largest peak of a load over the dissertation's.
        lowest: Least and largest lower end of a load's band [Hz].
        octaves: Least and largest width of the band.
        idle: Share of the loads that are left out, so that one axis moves alone.
        fade: Time over which a piece is faded in and out [s].
    """

    seconds: float = 10.0
    pieces: int = 4
    candidates: int = 40
    levels: tuple[float, float] = (0.2, 1.0)
    lowest: tuple[float, float] = (0.3, 4.0)
    octaves: tuple[float, float] = (1.0, 3.5)
    idle: float = 0.2
    fade: float = 0.25


SETTINGS = RecordSetSettings()
DISSERTATION, BOTH, DRAWN, COVERING = (
    "the dissertation's three",
    "both axes, three times",
    "one, then loads drawn at random",
    "one, then loads that cover most",
)


class Piece(NamedTuple):
    """Loads of a few seconds, sampled (n,) each [N], [N m]."""

    force: Array
    torque: Array


def peaks() -> tuple[float, float]:
    """Peak force [N] and torque [N m] that all sets keep to."""
    force, torque = (signal.peak for signal in laboratory.drive((True, True)).signals.values())  # type: ignore[attr-defined]
    return float(force), float(torque)


def drive(loaded: tuple[bool, bool]) -> Excitation:
    """The dissertation's loading, as long as a record is here."""
    return replace(laboratory.drive(loaded), duration=SETTINGS.seconds)


def candidates(rng: np.random.Generator) -> list[Piece]:
    """Loads of random band and level."""
    return [Piece(*_loads(rng)) for _ in range(SETTINGS.candidates)]


def _loads(rng: np.random.Generator) -> list[Array]:
    """Force and torque of a piece; at least one of them is there."""
    while True:
        idle = rng.random(2) < SETTINGS.idle
        if not idle.all():
            break
    rate, seconds = laboratory.SETUP.rate, SETTINGS.seconds / SETTINGS.pieces
    found = []
    for peak, off in zip(peaks(), idle, strict=True):
        low = float(np.exp(rng.uniform(*np.log(SETTINGS.lowest))))
        high = min(low * 2.0 ** rng.uniform(*SETTINGS.octaves), laboratory.SETUP.band[1])
        high = max(high, low + 2.0 / seconds)  # two lines of the spectrum at least
        level = float(np.exp(rng.uniform(*np.log(SETTINGS.levels))))
        noise = BandLimitedNoise(low=low, cutoff=high, peak=peak * level)
        signal: Signal = (
            Constant(0.0) if off else Tapered(noise, fade_in=SETTINGS.fade, fade_out=SETTINGS.fade)
        )
        found.append(signal.sample(round(seconds * rate), rate, rng))
    return found


def played(pieces: list[Piece]) -> Excitation:
    """Pieces one after the other."""
    rate = laboratory.SETUP.rate
    seconds = tuple(len(piece.force) / rate for piece in pieces)
    signals = {}
    for name in ("force", "torque"):
        parts = [getattr(piece, name) for piece in pieces]
        signals[name] = Concatenation(tuple(Record(part, rate) for part in parts), seconds)
    return Excitation(signals, duration=sum(seconds), sample_rate=rate)


def motion(rig: Rig, pieces: list[Piece], timestep: float) -> tuple[Array, Array]:
    """Displacements and velocities (n, 2) of the joint under pieces."""
    record = simulate(rig.with_(timestep=timestep), played(pieces), sample_rate=laboratory.SETUP.rate)
    names = laboratory.AXES
    return tuple(np.stack([record[name + end] for name in names], axis=1) for end in ("", "_velocity"))  # type: ignore[return-value]


class Sets(NamedTuple):
    """What is played in each set, and how much of the cells the designed ones were predicted to visit."""

    drives: dict[str, list[tuple[Excitation, int]]]
    covered: dict[str, float]


def sets(true: Rig, seed: int, timestep: float, progress: Progress) -> Sets:
    """The sets of one seed: excitations with the seeds of their noise.

    Args:
        true: The laboratory, for the first record of the designed set.
        seed: Draws loads and candidates.
        timestep: Of the simulations [s].
        progress: Told what is done.
    """
    rng = np.random.default_rng([seed, 331])
    noise = [int(x) for x in rng.integers(2**31, size=5)]
    both = drive((True, True))
    pilot = simulate(true, both, rng=np.random.default_rng(noise[0]), sample_rate=laboratory.SETUP.rate)
    progress("a rough joint from the first record")
    data = laboratory.view(laboratory.measured(pilot, rng))
    assert data.time is not None
    rough = fit_memory(data.states, data.forces, time=data.time, form="sliders", refine=0)
    twin = laboratory.rig().with_(elements=(Element(rough.law, laboratory.AXES, rough.theta, name="joint"),))
    pool = candidates(rng)
    progress(f"motions under {len(pool)} candidates")
    motions = [motion(twin, [piece], timestep) for piece in pool]
    seen = data.states[:, :2], data.states[:, 2:]
    # the range to be covered is that of the record under full loads
    half = np.max(np.abs(data.states), axis=0)
    coverage = Coverage(half[:2].tolist(), half[2:].tolist())
    n = 2 * SETTINGS.pieces
    chosen = coverage.most_covering(motions, n, after=[seen])
    covered = {COVERING: float(coverage.visited()[0])}
    coverage.most_covering(motions[:n], n, after=[seen])
    covered[DRAWN] = float(coverage.visited()[0])

    def designed(places: list[int]) -> list[tuple[Excitation, int]]:
        halves = places[: SETTINGS.pieces], places[SETTINGS.pieces :]
        return [(both, noise[0]), *((played([pool[i] for i in half]), 0) for half in halves)]

    drives = {
        DISSERTATION: [(drive(loaded), s) for loaded, s in zip(LOADINGS.values(), (noise[1], noise[2], noise[0]), strict=True)],
        BOTH: [(both, noise[0]), (both, noise[3]), (both, noise[4])],
        DRAWN: designed(list(range(n))),
        COVERING: designed(list(chosen)),
    }  # fmt: skip
    return Sets(drives, covered)
