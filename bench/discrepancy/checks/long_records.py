"""Records of more samples than a search makes use of: thinned where they were sampled far beyond what they hold, and cut.

A search fits hundreds of free runs, whose time grows with the samples. What samples tell of a parameter grows with their square root, and
is soon less than the error of any model. Judging records, of which few runs are made, stay whole.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from bench.discrepancy.case.case import Case, CaseRecord, beginning
from bench.discrepancy.likelihood.whitening import band_bins, fast_length
from bench.discrepancy.settings import DEFAULT, DiagnosisSettings


def thinned(case: Case, *, settings: DiagnosisSettings = DEFAULT) -> Case:
    """A case whose records for identification, where they are too long, hold every k-th sample, as far as nothing but noise is lost.

    Noise stays as large as it is stated; commands that are held from sample to sample, and responses behind an anti-aliasing filter,
    would be others.

    Args:
        case: The case.
        settings: Thresholds of the diagnosis.

    Returns:
        The case itself where no record is too long or sampled faster than it has to be.
    """
    if case.load_interpolation == "zero_order_hold" or any(c.antialias for c in case.channels):
        return case
    longest = _longest(case, settings)
    records = tuple(_thinned(case, record, longest, settings) for record in case.identification)
    return replace(case, identification=records)


def with_beginnings(case: Case, *, settings: DiagnosisSettings = DEFAULT) -> Case:
    """A case whose records for identification are no longer than a search makes use of: their beginnings, once something moves.

    Args:
        case: The case.
        settings: Thresholds of the diagnosis.
    """
    longest, quiet = _longest(case, settings), settings.checks.long_records.quiet
    records = (
        beginning(record, longest, first=min(_still(record, longest, quiet), len(record) - longest))
        if len(record) > longest
        else record
        for record in case.identification
    )
    return replace(case, identification=tuple(records))


def long_record_notes(told: Case, used: Case, *, settings: DiagnosisSettings = DEFAULT) -> tuple[str, ...]:
    """What is said of records that were thinned or cut.

    Args:
        told: The case as it came.
        used: The case as it is searched.
        settings: Thresholds of the diagnosis.
    """
    most = _longest(told, settings)
    found = []
    for whole, cut in zip(told.identification, used.identification, strict=True):
        if len(cut) == len(whole):
            continue
        every, end = round(cut.step / whole.step), cut.start + len(cut) * cut.step
        parts = []
        if every > 1:
            parts.append(f"one sample of {every}, since nothing but noise lies above {0.5 / cut.step:.3g} Hz")
        if cut.start > whole.start or end + cut.step < whole.start + len(whole) * whole.step:
            parts.append(f"{cut.start:.6g} to {end:.6g} s")
        found.append(
            f"'{whole.name}' holds {len(whole)} samples, and a search makes use of {most} (settings checks.long_records): fitted is "
            + ", of that ".join(parts)
        )
    return tuple(found)


def begun_at(whole: CaseRecord, cut: CaseRecord) -> int:
    """The sample of a record that a beginning of it starts with."""
    return round((cut.start - whole.start) / whole.step)


def after(whole: CaseRecord, cut: CaseRecord) -> CaseRecord | None:
    """What follows a beginning of a record, as a record that starts in motion; None where nothing does."""
    end = begun_at(whole, cut) + len(cut)
    if end >= len(whole):
        return None
    rest = beginning(whole, len(whole), first=end)
    return replace(rest, name=f"{whole.name}, from {rest.start:.6g} s on", at_rest=False)


def _longest(case: Case, settings: DiagnosisSettings) -> int:
    """Samples that a record may hold, so that all of them together keep within theirs."""
    limits = settings.checks.long_records
    left, rest = limits.together, sorted(min(len(record), limits.record) for record in case.identification)
    while rest and rest[0] * len(rest) <= left:
        left -= rest.pop(0)
    return left // len(rest) if rest else limits.record


def _thinned(case: Case, record: CaseRecord, longest: int, settings: DiagnosisSettings) -> CaseRecord:
    """Every k-th sample of a record, k as large as it has to be and as what the record holds allows."""
    if len(record) <= longest or record.periodic:
        return record
    limits = settings.checks.long_records
    # of all frequencies, by its own threshold
    settings = replace(
        settings,
        likelihood=replace(settings.likelihood, max_bins=len(record), above_noise=limits.above_noise),
    )
    # ends that do not join would leak into all frequencies; of power one
    taper = np.hanning(len(record)) / np.sqrt(3.0 / 8.0)
    bins = 1
    for channel in case.channels:
        samples = record.values[channel.name]
        level = channel.noise_std or limits.unstated * float(np.std(samples))
        if level > 0.0:
            tapered = taper * (samples - samples.mean())
            bins = max(bins, band_bins(tapered[:, None], np.array([level]), settings=settings.likelihood))
    top = bins / fast_length(len(record))
    every = min(math.ceil(len(record) / longest), int(1.0 / (limits.samples_a_period * top)))
    if every < 2:
        return record
    return replace(
        record,
        step=every * record.step,
        values={name: values[::every] for name, values in record.values.items()},
        bridged=tuple(i // every for i in record.bridged if i % every == 0),
    )


def _still(record: CaseRecord, samples: int, part: float) -> int:
    """Samples at the start of a record, in blocks, in which no channel leaves its first value by a part of its RMS change from there."""
    block = max(samples // 64, 1)
    firsts = np.arange(0, len(record), block)
    counts = np.diff(np.append(firsts, len(record)))
    moving = np.zeros(len(firsts), dtype=bool)
    for values in record.values.values():
        change = np.add.reduceat((values - values[:block].mean()) ** 2, firsts)
        moving |= change / counts > part**2 * change.sum() / len(record)
    return max(int(np.argmax(moving)) - 1, 0) * block
