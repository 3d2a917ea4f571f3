"""What a test is expected to say about two explanations: its expected log odds, and its power."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from bench.discrepancy.case.case import CaseRecord
from bench.discrepancy.likelihood.problem import Array, Problem
from bench.discrepancy.likelihood.whitening import whitened
from bench.discrepancy.next_test.belief import Belief
from bench.discrepancy.settings import NextTestSettings
from bench.excitation.bayes_factor import Contrast, expected_log_bayes_factor


class Outlook(NamedTuple):
    """What a test is expected to say about two rivals.

    Attributes:
        log_odds: Expected log Bayes factor in favour of the true one.
        power: Probability that the test ends with `odds` for the true one, whichever it is by the present odds.
        power_first: The same, if the first one is true.
        power_second: The same, if the second one is true.
    """

    log_odds: float
    power: float
    power_first: float
    power_second: float


def outlook(
    problem: Problem,
    first: Belief,
    second: Belief,
    record: CaseRecord,
    *,
    odds: float = 0.0,
    scale: float = 1.0,
) -> Outlook | None:
    """What a record of these loads is expected to say; None where a rival diverges.

    Args:
        problem: Records, structure and noise.
        first: The favourite.
        second: Its rival.
        record: Loads of the test.
        odds: Log odds of the present records in favour of the first.
        scale: Noise in units of the stated one.
    """
    responses = [rival.respond(problem, record) for rival in (first, second)]
    if not all(np.isfinite(r).all() for r in responses):
        return None
    # the responses decide how wide the band is: the present record's may lack what the new one shows
    simulated = dict(zip(problem.structure.channels, responses[0].T, strict=True))
    filled = CaseRecord(record.name, record.step, record.start, {**record.values, **simulated})
    data = problem.prepare(filled)
    bases = [whitened(r, data) for r in responses]
    a, b = (
        rival.sensitivity(problem, data, base) / scale
        for rival, base in zip((first, second), bases, strict=True)
    )
    r = (bases[0] - bases[1]) / scale
    size = max(a.shape[1], b.shape[1])
    a, b = (np.pad(m, ((0, 0), (0, size - m.shape[1]))) for m in (a, b))
    contrast = Contrast(np.asarray(r @ r), a.T @ r, b.T @ r, a.T @ a, b.T @ b, a.T @ b)
    expected = float(expected_log_bayes_factor(contrast))
    chances = _power(r, a, b, odds, settings=problem.settings.next_test)
    prior = 1.0 / (1.0 + np.exp(-np.clip(odds, -50.0, 50.0)))
    return Outlook(expected, prior * chances[0] + (1.0 - prior) * chances[1], *chances)


def _power(r: Array, a: Array, b: Array, odds: float, *, settings: NextTestSettings) -> tuple[float, float]:
    """Probability of `odds` for the true rival, under the first and under the second.

    All that differs lies in the span of the sensitivities and of the difference; there the draws are made.
    """
    basis, _ = np.linalg.qr(np.column_stack([a, b, r]))
    small = [basis.T @ x for x in (a, b)]
    offset = basis.T @ r
    n = len(offset)
    covariances = [np.eye(n) + x @ x.T for x in small]
    inverses = [np.linalg.inv(c) for c in covariances]
    logs = [np.linalg.slogdet(c)[1] for c in covariances]
    rng = np.random.default_rng(0)
    out = []
    for true in (0, 1):
        noise = (
            rng.standard_normal((settings.draws, n))
            + rng.standard_normal((settings.draws, small[true].shape[1])) @ small[true].T
        )
        # coordinates with the first rival's mean at the origin and the second's at minus the difference
        y = noise if true == 0 else noise - offset
        misfit = [
            np.einsum("ij,jk,ik->i", y + shift, inverse, y + shift)
            for shift, inverse in zip((0.0, offset), inverses, strict=True)
        ]
        factor = 0.5 * (misfit[1] - misfit[0] + logs[1] - logs[0]) + odds
        out.append(
            float(
                np.mean(factor > np.log(settings.odds))
                if true == 0
                else np.mean(factor < -np.log(settings.odds))
            )
        )
    return out[0], out[1]
