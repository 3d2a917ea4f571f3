"""The next test: of the excitations that a rig can do, the one that separates the rival explanations best.

The present records leave each rival a posterior; for the next test it is the prior. About it a record is, to first order,
normal with mean y and covariance ``I + J P J'`` in units of the noise, so that a difference which the rival makes up by
other parameters does not count. The merit is the expected log Bayes factor of `bench.excitation.bayes_factor`. Its distribution
under either rival, with the odds that the present records give already, is the power of the test: the probability that it ends
with odds of `odds` for the true one.

Where the records call for no effect at all, or cannot tell two apart, the reason is put into words, from what the motion reached.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy.linalg import block_diag

from bench.discrepancy.case.case import CaseRecord
from bench.discrepancy.effects.effect import Effect
from bench.discrepancy.fitting.goodness_of_fit import names
from bench.discrepancy.judgement.posterior import weights
from bench.discrepancy.likelihood.problem import Array, Problem
from bench.discrepancy.likelihood.whitening import RecordData, whitened
from bench.discrepancy.model.placement import Placed
from bench.discrepancy.next_test.distinguishability import why_alike, why_none
from bench.discrepancy.next_test.feasible_excitations import (
    Proposal,
    candidates,
    feasible,
    limits_of,
)
from bench.discrepancy.numerics.threads import in_threads
from bench.discrepancy.search.explanation import Explanation
from bench.discrepancy.settings import NextTestSettings
from bench.excitation.bayes_factor import Contrast, expected_log_bayes_factor

SPOKEN_OF = ("coulomb_friction", "gap", "cubic_stiffness", "quadratic_damping")
"""Effects whose detectable size is told where the records call for nothing: one of each family of forces."""


class Rival(NamedTuple):
    """An explanation as a Gaussian belief.

    Attributes:
        explanation: The explanation.
        vector: (n,) parameters of all its parts.
        root: (n, n) square root of their posterior covariance.
    """

    explanation: Explanation
    vector: Array
    root: Array

    @classmethod
    def of(cls, explanation: Explanation) -> Rival:
        """The posterior of an explanation."""
        precision = np.asarray(block_diag(*(fitted.precision for _, fitted in explanation.parts)), np.float64)
        values, vectors = np.linalg.eigh(0.5 * (precision + precision.T))
        # a direction that not even the prior holds would be no direction of the fit
        root = vectors / np.sqrt(np.maximum(values, 1e-8 * values.max()))
        return cls(explanation, np.concatenate([f.vector for _, f in explanation.parts]), root)

    def respond(self, problem: Problem, record: CaseRecord, vector: Array | None = None) -> Array:
        """Responses (n, n_channels) to a record's loads, in the order of the channels of `problem`."""
        chosen = self.vector if vector is None else vector
        out = np.zeros((len(record), len(problem.structure.channels)))
        at = 0
        for part, fitted in self.explanation.parts:
            own = chosen[at : at + len(fitted.vector)]
            at += len(fitted.vector)
            samples = part.simulate(fitted.hypothesis, own, record)
            for c, name in enumerate(part.structure.channels):
                out[:, problem.structure.channels.index(name)] = samples[:, c]
        return out

    def within(self, vector: Array) -> Array:
        """A vector clipped to the bounds of the priors."""
        low, high = [], []
        for part, fitted in self.explanation.parts:
            _, _, lower, upper = part.prior(fitted.hypothesis)
            low.append(lower)
            high.append(upper)
        return np.clip(vector, np.concatenate(low), np.concatenate(high))

    def sensitivity(self, problem: Problem, data: RecordData, base: Array) -> Array:
        """Derivative (n_residuals, n) of the whitened response along the columns of `root`."""
        columns = []
        for column in self.root.T:
            moved = self.within(self.vector + 0.2 * column)
            share = float((moved - self.vector) @ column / max(column @ column, 1e-300))
            if share < 0.1:
                moved = self.within(self.vector - 0.2 * column)
                share = float((moved - self.vector) @ column / max(column @ column, 1e-300))
            if abs(share) < 1e-6:
                columns.append(np.zeros(len(base)))
                continue
            changed = whitened(self.respond(problem, data.record, moved), data)
            columns.append((changed - base) / share if np.isfinite(changed).all() else np.zeros(len(base)))
        return np.column_stack(columns)


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


def separate(problem: Problem, explanations: Sequence[Explanation]) -> dict[str, Any]:
    """Propose the excitation that separates the best explanation from its closest rival.

    Args:
        problem: Problem on all degrees of freedom.
        explanations: By decreasing posterior.

    Returns:
        The rivals, why these records cannot tell them apart, the excitation in words and numbers, its expected log odds and
        power, and those of repeating the longest present record. Empty where the present records decide.
    """
    best = explanations[0]
    rivals = [e for e in explanations[1:] if _is_rival(best, e)]
    if not rivals or log_odds(best, rivals[0]) > problem.settings.next_test.decided or problem.windowed:
        return {}
    first, second = Rival.of(best), Rival.of(rivals[0])
    odds = log_odds(best, rivals[0])
    scale = _noise_scale(problem, best)
    repeated = max(problem.records, key=len)
    now = outlook(problem, first, second, repeated, odds=odds, scale=scale)
    out: dict[str, Any] = {
        "separates": [names(best.hypothesis), names(rivals[0].hypothesis)],
        "reason": why_alike(problem, best, rivals[0]),
        "log_odds_now": odds,
        "repeating": {} if now is None else {"expected_log_odds": now.log_odds, "power": now.power},
    }
    found = _best_of(problem, first, second, odds, scale)
    if found is None:
        return out | {"excitation": ""}
    proposal, look = found
    out |= _described(problem, proposal, look)
    out["also_against"] = _others(problem, first, rivals[1:], proposal, scale)
    return out


def told_apart(problem: Problem, kind: str, catalogue: Sequence[Effect]) -> dict[str, Any]:
    """What the records could have shown where they call for nothing; empty for other verdicts.

    Args:
        problem: Problem on all degrees of freedom.
        kind: The verdict.
        catalogue: Effects to speak of; forces on one coordinate only.
    """
    if kind != "none" or problem.driven or problem.windowed:
        return {}
    chosen = [
        Placed(effect, place)
        for place in problem.structure.places
        for effect in catalogue
        if len(place.rows) == 1 and effect.name in SPOKEN_OF and effect.site == "joint"
    ]
    reason = why_none(problem, chosen)
    return {"reason": reason} if reason else {}


def propose(problem: Problem, first: Explanation, second: Explanation) -> tuple[Proposal, Outlook] | None:
    """The excitation that separates two explanations best, and what it is expected to say; None where none is feasible."""
    scale = _noise_scale(problem, first)
    return _best_of(problem, Rival.of(first), Rival.of(second), log_odds(first, second), scale)


def _best_of(
    problem: Problem, first: Rival, second: Rival, odds: float, scale: float
) -> tuple[Proposal, Outlook] | None:
    """The feasible excitation of the largest expected log odds; None where none is feasible."""
    finalists = _finalists(problem, first, second)
    looks = in_threads(lambda p: outlook(problem, first, second, p.record, odds=odds, scale=scale), finalists)
    scored = [(look, p) for look, p in zip(looks, finalists, strict=True) if look is not None]
    if not scored:
        return None
    look, proposal = max(scored, key=lambda entry: entry[0].log_odds)
    return proposal, look


def outlook(
    problem: Problem,
    first: Rival,
    second: Rival,
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


def log_odds(first: Explanation, second: Explanation) -> float:
    """Log odds of the present records, as the verdict weighs them: with noise that is not stated they count for less."""
    shares = np.maximum(weights([first, second]), 1e-300)
    return float(np.log(shares[0]) - np.log(shares[1]))


def _is_rival(best: Explanation, other: Explanation) -> bool:
    """Whether another explanation says something else, rather than the same and one thing more."""
    own, theirs = ({p.key for p in e.hypothesis} for e in (best, other))
    return not own <= theirs


def _noise_scale(problem: Problem, best: Explanation) -> float:
    """Noise in units of the stated one: what the best explanation leaves, where that is more."""
    return float(np.sqrt(max(best.reduced, 1.0))) if not problem.noise_stated or not best.consistent else 1.0


def _finalists(problem: Problem, first: Rival, second: Rival) -> list[Proposal]:
    """Feasible excitations by the whitened difference of the rivals' responses, the largest first."""
    settings = problem.settings.next_test
    limits = limits_of(problem)
    longest = max(len(r) for r in problem.records)
    samples = min(longest, settings.samples // max(1, len(problem.structure.dofs) // 2))
    loads = _loads(problem, (*first.explanation.hypothesis, *second.explanation.hypothesis))

    def weigh(entry: tuple[str, Array]) -> list[tuple[float, Proposal]]:
        out = []
        for level in settings.levels:
            label, columns = entry
            shown = label if level == 1.0 else f"{label}, at {100 * level:.0f} % of what the rig can do"
            at_level = limits._replace(
                load={k: level * v for k, v in limits.load.items()},
                motion={k: level * v for k, v in limits.motion.items()},
            )
            found = feasible(
                problem, shown, columns, at_level,
                [lambda record, rival=rival: rival.respond(problem, record) for rival in (first, second)],
            )  # fmt: skip
            if found is not None:
                proposal, (a, b) = found
                out.append((float(np.sum(((a - b) / problem.noise) ** 2)), proposal))
        return out

    weighed = [x for part in in_threads(weigh, candidates(problem, loads, samples)) for x in part]
    weighed.sort(key=lambda entry: -entry[0])
    return [proposal for _, proposal in weighed[: settings.finalists]]


def _loads(problem: Problem, effects: Sequence[Placed]) -> list[int]:
    """Loads that move the places of some effects."""
    structure = problem.structure
    groups = structure.groups()
    out = []
    for j in range(len(structure.loads)):
        moved = {i for g in groups if np.any(structure.inputs[list(g), j] != 0.0) for i in g}
        touched = {int(i) for p in effects for i in np.flatnonzero(np.abs(p.place.rows).sum(axis=0))}
        if not touched or moved & touched:
            out.append(j)
    return out or list(range(len(structure.loads)))


def _described(problem: Problem, proposal: Proposal, look: Outlook) -> dict[str, Any]:
    record = proposal.record
    peak = max(proposal.peaks.values())
    return {
        "excitation": proposal.label,
        "peak_load": peak,
        "peak_loads": proposal.peaks,
        "largest_response": proposal.motion,
        "duration_s": len(record) * record.step,
        "expected_log_odds": look.log_odds,
        "power": look.power,
        "power_if_first": look.power_first,
        "power_if_second": look.power_second,
        "decides": bool(look.power > 0.9),
    }


def _others(
    problem: Problem, first: Rival, rivals: Sequence[Explanation], proposal: Proposal, scale: float
) -> list[dict[str, Any]]:
    """The same excitation against further rivals that the present records leave open."""
    settings = problem.settings.next_test
    out = []
    for rival in rivals[: settings.others]:
        odds = log_odds(first.explanation, rival)
        if odds > settings.decided:
            break
        look = outlook(problem, first, Rival.of(rival), proposal.record, odds=odds, scale=scale)
        if look is not None:
            out.append(
                {
                    "rival": names(rival.hypothesis),
                    "log_odds_now": odds,
                    "expected_log_odds": look.log_odds,
                    "power": look.power,
                }
            )
    return out
