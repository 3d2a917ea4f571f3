"""Cogging of a pitch too fine for any grid, found as a line in the spectrum of the missing force over the displacement.

Along a stroke of S a pitch p is told from others to about p^2 / S, so that a grid over all of them would need S / p points, each of which
is a response of the rig. Over the displacement the force is one line, whatever the speed, and the fit starts from it.

References:
    J. D. Scargle, Studies in astronomical time series analysis II, Astrophysical Journal 263, 1982 (periodograms of uneven samples).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize_scalar

from bench.arrays import Array
from bench.discrepancy.effects.catalogue import effect_named
from bench.discrepancy.likelihood.problem import Problem
from bench.discrepancy.model.placement import Placed
from bench.discrepancy.model.structure import Place
from bench.discrepancy.unscreened.missing_force import missing_force

COGGING = "cogging"


class _Line(NamedTuple):
    """``sine sin(2 pi q / pitch) + cosine cos(2 pi q / pitch)``, and the share of the missing force that it is."""

    pitch: float
    sine: float
    cosine: float
    share: float


def fine_cogging(problem: Problem) -> tuple[Placed, Array] | None:
    """Cogging where the missing force has a line over the displacement, the largest part of it, and its parameters to start from; None
    where it has none."""
    found = [
        (place, line)
        for place in problem.structure.places
        if len(place.rows) == 1 and (line := _line_at(problem, place)) is not None
    ]
    if not found:
        return None
    place, line = max(found, key=lambda one: one[1].share)
    placed = Placed(effect_named(COGGING), place)
    scales = problem.scales_of(placed)
    values = line.sine, line.cosine, line.pitch
    return placed, np.array(
        [p.eta(value, scales) for p, value in zip(placed.effect.parameters, values, strict=True)]
    )


def _line_at(problem: Problem, place: Place) -> _Line | None:
    """The line of the missing force over the displacement at a place; None where none stands out of what lies about it."""
    settings = problem.settings.search.cogging
    row = place.rows[0]
    motions = [problem.motion_of(record) for record in problem.records]
    q, v, a = (np.concatenate([part @ row for part in parts]) for parts in zip(*motions, strict=True))
    force = np.concatenate([missing_force(problem, record, place) for record in problem.records])
    stroke = float(np.ptp(q))
    every = len(q) // settings.most + 1
    passed = settings.samples * float(np.std(v)) * every * max(record.step for record in problem.records)
    finest = max(passed, stroke / settings.pitches)
    if not 0.0 < 2.0 * finest < stroke:
        return None
    smooth = np.column_stack([np.ones_like(q), q, q**2, q**3, v, a, np.sign(v)])
    left = force - smooth @ np.linalg.lstsq(smooth, force, rcond=None)[0]
    waves = np.arange(1.0, stroke / finest, 1.0 / settings.finer) / stroke
    power = np.array([_power(wave, q[::every], left[::every]) for wave in waves])
    middle = np.median(power)
    best = int(np.argmax(power))
    # of a spectrum that is exponentially distributed, the largest of so many
    if not power[best] > middle * math.log(len(waves) / settings.false_alarm) / math.log(2.0):
        return None
    near = 1.0 / stroke / settings.finer
    refined = minimize_scalar(
        lambda wave: -_power(wave, q, left), bounds=(waves[best] - near, waves[best] + near), method="bounded"
    )
    angle = 2.0 * math.pi * float(refined.x) * q
    basis = np.column_stack([np.sin(angle), np.cos(angle)])
    sine, cosine = np.linalg.lstsq(basis, left, rcond=None)[0]
    share = float(np.var(basis @ [sine, cosine]) / np.var(force))
    # what is missing pushes; the law is what the structure loses
    return _Line(1.0 / float(refined.x), -float(sine), -float(cosine), share)


def _power(wave: float, q: Array, force: Array) -> float:
    return float(np.abs(np.exp(-2j * math.pi * wave * q) @ force) ** 2 / len(q))
