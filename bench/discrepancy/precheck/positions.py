"""Faults of a measured position that no motion makes: a jump where rows were lost, a reading that stands at the end of its range."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from bench.arrays import Array
from bench.discrepancy.case.case import CaseRecord
from bench.discrepancy.settings import DEFAULT


@dataclass(frozen=True)
class PositionsSettings:
    """Numbers of `bench.discrepancy.precheck.positions`."""

    jump: float = 3.0
    """Step between two samples, over the longest of the record and of its neighbours, that no mass makes."""
    noise: float = 8.0
    """The same over the noise, beyond any chance."""
    around: int = 3
    """Neighbours on either side."""
    longest: float = 99.0
    """Percentile of the steps that stands for the longest of a motion: lost rows make one such step."""
    moving: float = 0.3
    """Step before a reading stands at its end, over the RMS step, from which it was in motion: a drive that stops there slows down."""
    repeated: float = 0.2
    """Part of the steps that are zero from which a reading repeats itself anyway, as that of a coarse encoder."""


SETTINGS = PositionsSettings()


def position_doubts(
    name: str, record: CaseRecord, noise: float, target: Array | None = None
) -> Iterator[str]:
    """What is wrong with a position, a sentence each.

    Args:
        name: Its channel.
        record: The record.
        noise: Its noise, as stated.
        target: What it is to follow (n,), of a servo.
    """
    yield from _jumps(name, record, noise)
    yield from _ends(name, record, target)


def _jumps(name: str, record: CaseRecord, noise: float) -> Iterator[str]:
    """A step that is longer than the motion around it makes: a mass takes time to get up to speed."""
    moved = np.abs(np.diff(record.values[name]))
    if len(moved) < 4 * SETTINGS.around:
        return
    usual = float(np.percentile(moved, SETTINGS.longest))
    for k in np.flatnonzero(moved > max(SETTINGS.jump * usual, SETTINGS.noise * noise)):
        beside = np.delete(
            moved[max(k - SETTINGS.around, 0) : k + SETTINGS.around + 1], min(k, SETTINGS.around)
        )
        if moved[k] > SETTINGS.jump * float(beside.max()):
            when = record.start + k * record.step
            yield (
                f"'{name}' in '{record.name}' jumps by {moved[k]:.3g} at t = {when:.6g} s, {moved[k] / max(usual, 1e-300):.2g} times its "
                "fastest step elsewhere: rows that were lost there? Cut the record in two"
            )
            return


def _runs_into(x: Array, end: float) -> bool:
    """Whether a reading comes to its end in motion, not as a joint that is stopped there by its drive."""
    begins = np.flatnonzero((x[2:-1] == end) & (x[3:] == end) & (x[1:-2] != end)) + 2
    if len(begins) == 0:
        return False
    approach, moved = float(np.median(np.abs(x[begins - 1] - x[begins - 2]))), np.abs(np.diff(x))
    # a coarse encoder that turns slowly goes from one number to the next
    return approach > max(
        SETTINGS.moving * float(np.sqrt(np.mean(moved**2))), 1.5 * float(moved[moved > 0.0].min())
    )


def _further(x: Array, target: Array, end: float) -> bool:
    """Whether a servo misses its target by more where its reading stands at an end than anywhere else: it may have gone further."""
    there, missed = x == end, np.abs(target - x)
    return float(missed[there].max()) > float(missed[~there].max())


def _ends(name: str, record: CaseRecord, target: Array | None) -> Iterator[str]:
    """A reading that is at times one and the same largest or smallest number, though it changes with every sample otherwise."""
    x = np.asarray(record.values[name])
    if not np.ptp(x):  # a joint that was held
        return
    if np.mean((np.diff(x) == 0.0) & (x[1:] > x.min()) & (x[1:] < x.max())) > SETTINGS.repeated:
        return
    for end in (float(x.max()), float(x.min())):
        share = float(np.mean(x == end))
        if target is not None and not _further(x, target, end):
            continue
        if DEFAULT.checks.levelled < share < DEFAULT.checks.square and _runs_into(x, end):
            yield (
                f"'{name}' in '{record.name}' reads {end:.6g} in {100.0 * share:.2g} % of the samples and never beyond: the end of the "
                "sensor's range? Measure with a wider one, or move less"
            )
