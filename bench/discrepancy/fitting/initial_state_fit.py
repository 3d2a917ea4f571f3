"""Initial states of records that no fit has seen, estimated from the record itself, and what is said about them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from bench.arrays import Array
from bench.discrepancy.case.case import CaseRecord
from bench.discrepancy.model.placement import Hypothesis
from bench.discrepancy.response.initial_states import in_motion
from bench.discrepancy.response.simulator import Simulator
from bench.discrepancy.response.windows import cut


def predict(simulator: Simulator, hypothesis: Hypothesis, vector: Array, record: CaseRecord) -> Array:
    """Free run (n, n_channels) of a record, from estimated initial states where rest is not the start.

    Initial states are those that leave the smallest residual, weighted by the noise, in the window that follows each: two
    numbers a degree of freedom against the samples of the window. A wrong model gets the start that suits it best,
    too; the gap it leaves is then due to what it lacks and not to a start that was measured poorly.

    Args:
        simulator: Records and nominal model.
        hypothesis: Effects.
        vector: See `Simulator.simulate`.
        record: Any record of the case.
    """
    settings = simulator.settings
    fitted = record.name in {r.name for r in simulator.records}
    if simulator.driven or (not simulator.windowed and (fitted or not in_motion(record))):
        return simulator.simulate(hypothesis, vector, record)
    firsts = simulator.firsts(record)
    responses = simulator.responses_of(record)
    steps = simulator.start_differences(record)
    starts = simulator.starts_of(record, simulator.nominal)
    damping = np.ones(len(firsts))
    channels = simulator.simulate(hypothesis, vector, record, starts=starts)
    residual = (responses - channels) / simulator.noise
    costs = _costs(residual, firsts)
    for _ in range(settings.fitting.state_rounds):
        columns = [
            (simulator.simulate(hypothesis, vector, record, starts=starts + step) - channels)
            / simulator.noise
            for step in np.diag(steps)
        ]
        trial = starts.copy()
        for w, (first, end) in enumerate(zip(firsts, np.append(firsts[1:], len(responses)), strict=True)):
            matrix = np.column_stack([column[first:end].ravel() for column in columns])
            if np.isfinite(matrix).all() and np.isfinite(costs[w]):
                move = np.linalg.lstsq(
                    matrix, residual[first:end].ravel(), rcond=settings.fitting.state_singular
                )[0]
                trial[w] += damping[w] * move * steps
        tried = simulator.simulate(hypothesis, vector, record, starts=trial)
        tried_residual = (responses - tried) / simulator.noise
        tried_costs = _costs(tried_residual, firsts)
        better = tried_costs < costs
        settled = np.all(np.abs(costs - tried_costs) <= 1e-6 * costs)
        starts[better] = trial[better]
        damping = np.where(better, np.minimum(2.0 * damping, 1.0), 0.3 * damping)
        # windows are independent of one another, so the better ones can be kept alone
        taken = np.repeat(better, np.diff(np.append(firsts, len(responses))))
        channels[taken], residual[taken] = tried[taken], tried_residual[taken]
        costs = np.where(better, tried_costs, costs)
        if settled:
            break
    return channels


def _costs(residual: Array, firsts: NDArray[np.int64]) -> Array:
    squares = np.add.reduceat(np.sum(residual**2, axis=1), firsts)
    return np.where(np.isfinite(squares), squares, np.inf)


def run_kind(simulator: Simulator, records: Sequence[CaseRecord]) -> str:
    """How the validation records are simulated, for the name of the metric."""
    if simulator.driven:
        return "prescribed motion"
    if simulator.windowed:
        length = (
            cut(simulator.case, records[0], len(simulator.noise), settings=simulator.settings.likelihood)[1]
            * records[0].step
        )
        return f"windows of {length:.3g} s restarted from the estimated state"
    if any(in_motion(record) for record in records):
        return "free run from the estimated initial state"
    return "free run"


def start_warnings(simulator: Simulator, records: Sequence[CaseRecord]) -> list[str]:
    """What the reader of a verdict should know about the starts."""
    if simulator.driven:
        return []
    if simulator.windowed:
        lengths = [
            cut(simulator.case, r, len(simulator.noise), settings=simulator.settings.likelihood)[1] * r.step
            for r in records
        ]
        return [
            "no stiffness holds the motion, so a free run drifts: fits and gap use windows of "
            f"{min(lengths):.3g} s, each restarted from the estimated state"
        ]
    moving = [record.name for record in records if in_motion(record)]
    if moving:
        return [f"the initial state was estimated where the record starts in motion: {', '.join(moving)}"]
    return []
