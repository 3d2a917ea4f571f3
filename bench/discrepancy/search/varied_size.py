"""Effects whose size follows a channel or differs between records, against the same of one size."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bench.discrepancy.effects.read_off import DIFFERS
from bench.discrepancy.search.explanation import Explanation


def steadier(explanation: Explanation, other: Explanation) -> bool:
    """Whether an explanation has the effects of another one, fewer of them of a size that follows something."""
    effects, others = ([p.effect for p in e.hypothesis] for e in (explanation, other))
    fewer = sum(bool(e.varies) for e in effects) < sum(bool(e.varies) for e in others)
    return fewer and _plain(explanation) == _plain(other)


def differs_in_vain(explanation: Explanation, others: Sequence[Explanation]) -> bool:
    """Whether sizes of friction, hysteresis or damping that may differ between records do so by no more than right models are off, and
    the same effects of one size are among others."""
    spreads = []
    for problem, fitted in explanation.parts:
        _, etas = problem.split(fitted.hypothesis, fitted.vector)
        for placed, eta in zip(fitted.hypothesis, etas, strict=True):
            effect = placed.effect
            if effect.name.startswith(DIFFERS) and not effect.parameters[0].signed:
                sizes = effect.values(eta, problem.scales_of(placed))[: len(problem.records)]
                spreads.append(float(np.std(sizes) / np.mean(sizes)))
    hardly = bool(spreads) and max(spreads) < explanation.settings.likelihood.error.crude
    return hardly and any(steadier(other, explanation) for other in others)


def _plain(explanation: Explanation) -> frozenset[tuple[str, str]]:
    return frozenset((p.effect.varies or p.effect.name, p.place.name) for p in explanation.hypothesis)
