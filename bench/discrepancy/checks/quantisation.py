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
from numpy.typing import NDArray

from bench.discrepancy.verdict import Estimate, NamedEffect

if TYPE_CHECKING:
    from bench.discrepancy.case.case import CaseChannel
    from bench.discrepancy.effects.effect import Effect
    from bench.discrepancy.likelihood.problem import Problem
    from bench.discrepancy.model.structure import Observer

LATTICE = 0.02
"""Distance from a lattice point, in steps, that the rounding of a text file may leave."""
REPEATED = 0.5
"""Part of the samples that must repeat an earlier value, before a lattice is looked for."""
COARSE = 4.0
"""Step over noise from which the quantisation outweighs the noise."""


def quantisation_step(samples: NDArray[np.float64]) -> float:
    """Step of the lattice on which all samples lie; zero where there is none.

    Args:
        samples: (n,).
    """
    values = np.unique(samples)
    if len(values) < 3 or len(values) > (1.0 - REPEATED) * len(samples):
        return 0.0
    gaps = np.diff(values)
    # a text file may print the same lattice point in two ways that differ in the last digit
    gaps = gaps[gaps > 1e-7 * float(np.ptp(values))]
    step = float(gaps.min())
    multiples = np.round(gaps / step)
    step = float(gaps.sum() / multiples.sum())
    if np.max(np.abs(gaps / step - np.round(gaps / step))) > LATTICE:
        return 0.0
    return step


def raised_noise(noise: float, samples: NDArray[np.float64]) -> float:
    """Noise of a channel with that of its quantisation, where the latter is the coarser one.

    Args:
        noise: One-sigma noise as stated.
        samples: (n,).
    """
    step = quantisation_step(samples)
    if step <= noise:
        return noise
    return float(np.hypot(noise, step / np.sqrt(12.0)))


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
            step = max(quantisation_step(record.values[channel.name]) for record in problem.records)
            if observer.order != orders[effect.quantity] or step <= COARSE * _apart(problem, channel, step):
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
