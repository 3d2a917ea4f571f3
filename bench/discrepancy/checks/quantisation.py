"""Quantisation, read off the samples themselves: values that all lie on one lattice.

A converter of step q leaves the samples on multiples of q, and an error of variance ``q^2 / 12`` that no fit removes
(Widrow's pseudo-noise). The lattice is there to be seen, so it needs no hypothesis test; where it is coarser than the noise,
the noise of the channel is raised by it and the effect is named.

References:
    B. Widrow, I. Kollar, Quantization Noise, 2008, ch. 4.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from bench.discrepancy.case.channel_noise import quantisation_step
from bench.discrepancy.verdict import Estimate, NamedEffect

if TYPE_CHECKING:
    from bench.discrepancy.case.case import CaseChannel
    from bench.discrepancy.effects.effect import Effect
    from bench.discrepancy.likelihood.problem import Problem
    from bench.discrepancy.motion.observer import Observer


def recorded(problem: Problem, catalogue: Sequence[Effect]) -> tuple[NamedEffect, ...]:
    """Effects of a catalogue that show in the samples themselves: channels whose lattice is coarser than their noise.

    Args:
        problem: Identification records.
        catalogue: Effects to consider; those of site "record".
    """
    if problem.driven:
        return ()
    out = []
    orders = {"position": 0, "acceleration": 2}
    for effect in (e for e in catalogue if e.site == "record"):
        for observer in problem.structure.observers:
            channel = problem.case.channel(observer.channel)
            step = max(
                quantisation_step(record.values[channel.name], settings=problem.settings.case)
                for record in problem.records
            )
            if observer.order != orders[
                effect.quantity
            ] or step <= problem.settings.checks.coarse_step * _apart(problem, channel, step):
                continue
            out.append(
                NamedEffect(
                    name=effect.name,
                    where=_place(problem, observer),
                    probability=1.0,
                    parameters={"step": Estimate(step, 0.0, channel.unit)},
                    channel=channel.name,
                    equation=effect.equation,
                )
            )
    return tuple(out)


def _apart(problem: Problem, channel: CaseChannel, step: float) -> float:
    """Noise of a channel apart from its quantisation, as far as it is stated or can be seen."""
    if channel.noise_std:
        return channel.noise_std
    floor = problem.noise[problem.structure.channels.index(channel.name)]
    return float(np.sqrt(max(floor**2 - step**2 / 12.0, 0.0)))


def _place(problem: Problem, observer: Observer) -> str:
    touched = (
        p.name for p in problem.structure.places if len(p.rows) == 1 and np.any(p.rows[0] * observer.row)
    )
    return next(touched, "")
