"""Faults that show in the samples of a channel alone: torn values, a stuck sensor."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from bench.discrepancy.case.case import Case, CaseChannel, CaseRecord
from bench.discrepancy.precheck.settings import CheckSettings
from bench.recording.outliers import SETTINGS as OUTLIERS


def sample_doubts(case: Case, settings: CheckSettings) -> Iterator[str]:
    """What is wrong with single channels, a sentence each.

    Args:
        case: The case.
        settings: When something counts.
    """
    for record in (*case.identification, *case.validation):
        for channel in case.channels:
            if channel.name in record.values:
                yield from _torn(record, channel.name, settings)
                yield from _frozen(record, channel, settings)


def _torn(record: CaseRecord, name: str, settings: CheckSettings) -> Iterator[str]:
    """Single samples that leave the course of their neighbours and come back at once, as torn or swapped rows leave them."""
    x = np.asarray(record.values[name])
    if len(x) < 16:
        return
    # a third difference is small for whatever is smooth at the sample rate; noise makes it as large as itself everywhere
    middle = np.abs(x[2:-2] - (x[1:-3] + x[3:-1]) * (2.0 / 3.0) + (x[:-4] + x[4:]) / 6.0)
    usual = float(np.percentile(middle, 99.0))
    spread = float(np.ptp(np.percentile(x, (1.0, 99.0))))
    worst = np.flatnonzero(middle > max(settings.glitch * usual, 0.02 * spread))
    # a step of a square wave leaves the same, but does not come back: neighbours two samples away then differ as much
    back = [k for k in worst + 2 if abs(x[k - 2] - x[k + 2]) < 0.3 * abs(x[k] - 0.5 * (x[k - 2] + x[k + 2]))]
    # what happens over and over belongs to the record: impacts
    if 0 < len(back) <= max(OUTLIERS.fewest, OUTLIERS.most * len(x)):
        when = record.start + back[0] * record.step
        yield (
            f"'{name}' in '{record.name}' jumps away and back at t = {when:.6g} s ({len(back)} such sample(s)): a torn or swapped row? "
            "Correct or cut it"
        )


def _frozen(record: CaseRecord, channel: CaseChannel, settings: CheckSettings) -> Iterator[str]:
    """A channel that stands still for a while, though it otherwise changes with every sample.

    A joint that its friction holds reads one number, too, and a velocity of zero: it then sets off from where it is. A command rests
    where it is told to.
    """
    if channel.role == "command":
        return
    name = channel.name
    x = np.asarray(record.values[name])
    same = np.diff(x) == 0.0
    if np.mean(same) > 0.2 or not same.any():
        return
    edges = np.flatnonzero(np.diff(np.concatenate([[False], same, [False]]).astype(np.int8)))
    first, last = edges[::2], edges[1::2]
    k = int(np.argmax(last - first))
    length = int(last[k] - first[k])
    at_rest = first[k] == 0 or last[k] == len(same)
    if channel.quantity == "velocity" and x[first[k]] == 0.0:
        return
    if channel.quantity == "position":
        moved = np.abs(np.diff(x))
        if moved[last[k] : last[k] + 2].max(initial=0.0) < settings.resumed * np.percentile(moved, 99.0):
            return
    if length >= settings.frozen and not at_rest:
        when = record.start + first[k] * record.step
        yield (
            f"'{name}' in '{record.name}' stands still for {length} samples from t = {when:.6g} s on, though it changes with every other "
            "sample: dropped samples that were filled up, or a stuck sensor? Cut the record there"
        )
