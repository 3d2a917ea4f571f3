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
from typing import Any

import numpy as np

from bench.discrepancy.effects.effect import Effect
from bench.discrepancy.fitting.goodness_of_fit import names
from bench.discrepancy.judgement.posterior import weights
from bench.discrepancy.likelihood.problem import Array, Problem
from bench.discrepancy.model.placement import Placed
from bench.discrepancy.next_test.belief import Belief
from bench.discrepancy.next_test.closed_loop import closed_loop
from bench.discrepancy.next_test.distinguishability import why_alike, why_none
from bench.discrepancy.next_test.feasible_excitations import (
    SizedExcitation,
    candidates,
    limits_of,
    scaled_to_limits,
)
from bench.discrepancy.next_test.outlook import Outlook, outlook
from bench.discrepancy.numerics.threads import in_threads
from bench.discrepancy.response.simulator import Simulator
from bench.discrepancy.search.explanation import Explanation

SPOKEN_OF = ("coulomb_friction", "gap", "cubic_stiffness", "quadratic_damping")
"""Effects whose detectable size is told where the records call for nothing: one of each family of forces."""


def separate(problem: Problem, explanations: Sequence[Explanation]) -> dict[str, Any]:
    """Propose the excitation that separates the best explanation from its closest rival.

    Args:
        problem: Problem on all degrees of freedom.
        explanations: By decreasing posterior.

    Returns:
        The rivals, why these records cannot tell them apart, the excitation in words and numbers, its expected log odds and
        power, those of repeating the longest present record, and the question as a planner takes it that shapes the force while it
        measures. Empty where the present records decide.
    """
    best = explanations[0]
    rivals = [e for e in explanations[1:] if _is_rival(best, e)]
    if not rivals or log_odds(best, rivals[0]) > problem.settings.next_test.decided or problem.windowed:
        return {}
    first, second = Belief.of(best), Belief.of(rivals[0])
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
    if asked := closed_loop(problem, best, rivals[0]):
        out["closed_loop"] = asked
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


def propose(
    problem: Problem, first: Explanation, second: Explanation
) -> tuple[SizedExcitation, Outlook] | None:
    """The excitation that separates two explanations best, and what it is expected to say; None where none is feasible."""
    scale = _noise_scale(problem, first)
    return _best_of(problem, Belief.of(first), Belief.of(second), log_odds(first, second), scale)


def _best_of(
    problem: Problem, first: Belief, second: Belief, odds: float, scale: float
) -> tuple[SizedExcitation, Outlook] | None:
    """The feasible excitation of the largest expected log odds; None where none is feasible."""
    finalists = _finalists(problem, first, second)
    looks = in_threads(lambda p: outlook(problem, first, second, p.record, odds=odds, scale=scale), finalists)
    scored = [(look, p) for look, p in zip(looks, finalists, strict=True) if look is not None]
    if not scored:
        return None
    look, proposal = max(scored, key=lambda entry: entry[0].log_odds)
    return proposal, look


def log_odds(first: Explanation, second: Explanation) -> float:
    """Log odds of the present records, as the verdict weighs them: with noise that is not stated they count for less."""
    shares = np.maximum(weights([first, second]), 1e-300)
    return float(np.log(shares[0]) - np.log(shares[1]))


def _is_rival(best: Explanation, other: Explanation) -> bool:
    """Whether another explanation names something else, rather than the same, in another variant or with one thing more."""
    own, theirs = ({(p.effect.name, p.place.name, p.target) for p in e.hypothesis} for e in (best, other))
    return not own <= theirs


def _noise_scale(simulator: Simulator, best: Explanation) -> float:
    """Noise in units of the stated one: what the best explanation leaves, where that is more."""
    return (
        float(np.sqrt(max(best.reduced, 1.0))) if not simulator.noise_stated or not best.consistent else 1.0
    )


def _finalists(simulator: Simulator, first: Belief, second: Belief) -> list[SizedExcitation]:
    """Feasible excitations by the whitened difference of the rivals' responses, the largest first."""
    settings = simulator.settings.next_test
    limits = limits_of(simulator)
    longest = max(len(r) for r in simulator.records)
    samples = min(longest, settings.samples // max(1, len(simulator.structure.dofs) // 2))
    loads = _loads(simulator, (*first.explanation.hypothesis, *second.explanation.hypothesis))

    def weigh(entry: tuple[str, Array]) -> list[tuple[float, SizedExcitation]]:
        out = []
        for level in settings.levels:
            label, columns = entry
            shown = label if level == 1.0 else f"{label}, at {100 * level:.0f} % of what the rig can do"
            at_level = limits._replace(
                load={k: level * v for k, v in limits.load.items()},
                motion={k: level * v for k, v in limits.motion.items()},
            )
            found = scaled_to_limits(
                simulator, shown, columns, at_level,
                [lambda record, rival=rival: rival.respond(simulator, record) for rival in (first, second)],
            )  # fmt: skip
            if found is not None:
                proposal, (a, b) = found
                out.append((float(np.sum(((a - b) / simulator.noise) ** 2)), proposal))
        return out

    weighed = [x for part in in_threads(weigh, candidates(simulator, loads, samples)) for x in part]
    weighed.sort(key=lambda entry: -entry[0])
    return [proposal for _, proposal in weighed[: settings.finalists]]


def _loads(simulator: Simulator, effects: Sequence[Placed]) -> list[int]:
    """Loads that move the places of some effects."""
    structure = simulator.structure
    groups = structure.groups()
    out = []
    for j in range(len(structure.loads)):
        moved = {i for g in groups if np.any(structure.inputs[list(g), j] != 0.0) for i in g}
        touched = {int(i) for p in effects for i in np.flatnonzero(np.abs(p.place.rows).sum(axis=0))}
        if not touched or moved & touched:
            out.append(j)
    return out or list(range(len(structure.loads)))


def _described(simulator: Simulator, proposal: SizedExcitation, look: Outlook) -> dict[str, Any]:
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
    problem: Problem, first: Belief, rivals: Sequence[Explanation], proposal: SizedExcitation, scale: float
) -> list[dict[str, Any]]:
    """The same excitation against further rivals that the present records leave open."""
    settings = problem.settings.next_test
    out = []
    for rival in rivals[: settings.others]:
        odds = log_odds(first.explanation, rival)
        if odds > settings.decided:
            break
        look = outlook(problem, first, Belief.of(rival), proposal.record, odds=odds, scale=scale)
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
