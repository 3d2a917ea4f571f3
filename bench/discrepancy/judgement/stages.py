"""How far the discrepancy shrinks on the validation records, stage by stage: parameters alone, effect by effect, with a free model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from bench.discrepancy.case.case import Case
from bench.discrepancy.effects.nonparametric import CLOSURES
from bench.discrepancy.fitting.goodness_of_fit import names
from bench.discrepancy.judgement.nonparametric_rival import Rival
from bench.discrepancy.likelihood.problem import Problem
from bench.discrepancy.model.placement import Hypothesis
from bench.discrepancy.prediction.validation_discrepancy import gaps, nominal_prediction
from bench.discrepancy.search.closures import close
from bench.discrepancy.search.explanation import Explanation, nominal_alone
from bench.discrepancy.verdict import Gap, VerdictKind


def shrunk(
    case: Case,
    problem: Problem,
    explanations: Sequence[Explanation],
    kind: VerdictKind,
    rival: Rival | None,
    rng: np.random.Generator,
    nearest: Explanation,
) -> tuple[Explanation, str, tuple[Gap, ...]]:
    """How far the discrepancy shrinks: the explanation behind `Gap.after`, the closure in it if any, and the gaps."""
    best, nothing = explanations[0], nominal_alone(explanations)
    final, closure = best, ""
    stages = [("nominal", nominal_prediction(problem)), ("parameters only", nothing.predict)]
    stages += [(label, e.predict) for label, e in _path(explanations)]
    if kind == "unknown":
        final, closure = _closed(best, nothing, rival)
        label = names(nearest.hypothesis)
        tells = label not in dict(stages) and all(_finite(nearest.predict(r)) for r in case.validation)
        stages += [(label, nearest.predict)] if tells else []
    stages.append((names(final.hypothesis), final.predict))
    found = gaps(case, problem, stages=stages, rng=rng, final=_model(final))
    if kind == "unknown" and any(
        gap.after > problem.settings.judgement.closure_worse * gap.parameters_only for gap in found
    ):
        # what imitates an unknown force on some records can be worse than nothing on others: nobody should build that in
        final, closure = nothing, ""
        stages[-1] = ("no closure helps", nothing.predict)
        found = gaps(case, problem, stages=stages, rng=rng, final=_model(final))
    return final, closure, found


def _finite(run: Mapping[str, np.ndarray]) -> bool:
    return all(np.isfinite(samples).all() for samples in run.values())


def _closed(best: Explanation, nothing: Explanation, rival: Rival | None) -> tuple[Explanation, str]:
    """What a free model makes of an unknown gap: alone where that explains the records, else the likelier of alone and on top."""
    if rival is not None and rival.explanation.consistent:
        return rival
    closed = close(best, nothing, CLOSURES)
    if rival is None or rival.explanation.log_posterior < closed[0].log_posterior:
        return closed
    return (
        rival
        if rival.explanation.reduced - 1.0 < best.settings.search.stalled * (best.reduced - 1.0)
        else closed
    )


def _model(explanation: Explanation) -> tuple[Hypothesis, np.ndarray] | None:
    """Effects and vector of an explanation in one part; None where it has several."""
    fits = [fitted for _, fitted in explanation.parts]
    return (fits[0].hypothesis, fits[0].vector) if len(fits) == 1 else None


def _path(explanations: Sequence[Explanation]) -> list[tuple[str, Explanation]]:
    """Explanations that lead to the best one by adding its effects one by one, best first effect first."""
    target = {p.key for p in explanations[0].hypothesis}
    steps: list[tuple[str, Explanation]] = []
    reached: set[tuple[str, str, str]] = set()
    for size in range(1, len(target)):
        for e in explanations:
            keys = {p.key for p in e.hypothesis}
            if len(keys) == size and reached < keys < target:
                steps.append((names(e.hypothesis), e))
                reached = keys
                break
    return steps
