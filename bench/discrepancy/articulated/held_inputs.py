"""How the inputs of an articulated model are read between their samples, where nobody says: held, where that does as well as short delays.

A controller that holds its command from sample to sample is late by half a sample at every motor. Read as straight lines between the
samples, its records ask for a short delay or lag at each; read as held, for nothing.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from bench.discrepancy.articulated.explaining import Explained, asked_as
from bench.discrepancy.articulated_effects.hypothesis import PlacedOnJoint, placed_values
from bench.discrepancy.articulated_judgement.judgement import Judge
from bench.discrepancy.articulated_search.fitting import ArticulatedFit
from bench.discrepancy.articulated_search.problem import ArticulatedProblem
from bench.discrepancy.articulated_search.search import shortened
from bench.discrepancy.case.case import Case
from bench.discrepancy.search.load_interpolation import STATED

HELD = (
    "inputs are read as held from sample to sample, which explains the records without delays of less than a sample; state "
    '"load_interpolation": "zero_order_hold" if they were'
)

ONCE_MORE = "once more, the inputs read as held between their samples"


def explained_as_held(
    case: Case, found: Explained, asked: Callable[[Case], Explained], progress: Callable[[str], None]
) -> Explained | None:
    """What explains the records with their inputs held from sample to sample, where that does as well; None where it does not.

    Args:
        case: The case, its inputs read as straight lines.
        found: What explains it so.
        asked: Explains a case.
        progress: Called with a line of text at every stage.
    """
    reading = read_as_held(case, found)
    if reading is None or not found.problem.deadline.allows(ONCE_MORE):
        return None
    progress(ONCE_MORE)
    held = asked(reading.case)
    return held if does_as_well(held, found, reading.without) else None


class HeldInputs(NamedTuple):
    """Inputs read as held from sample to sample, where that is worth a search.

    Attributes:
        case: The case, its inputs held from sample to sample.
        without: What was found with straight lines between the samples, fitted once more without its delays of less than a sample.
    """

    case: Case
    without: ArticulatedFit


def read_as_held(case: Case, found: Explained) -> HeldInputs | None:
    """The inputs held from sample to sample, where that is worth another search.

    It is where nobody says how they are to be read, and the hold by itself explains more of what the delays and lags of less than a
    sample among the named effects do than it leaves to them.

    Args:
        case: The case, its inputs read as straight lines.
        found: What explains it so.
    """
    late = _shorter_than_a_sample(found)
    if STATED in case.options or not late:
        return None
    problem, final = found.problem, found.final
    held = replace(case, options={**case.options, STATED: "zero_order_hold"})
    other = ArticulatedProblem.of(
        held, problem.model, held.identification, problem.settings, problem.deadline
    )
    by_hold = shortened(asked_as(problem, other.softened(problem.softness)), final, late).log_posterior
    without = shortened(problem, final, late)
    explains_most = by_hold - without.log_posterior > final.log_posterior - by_hold
    return HeldInputs(held, without) if explains_most else None


def does_as_well(held: Explained, found: Explained, without: ArticulatedFit) -> bool:
    """Whether an explanation of held inputs is likelier than another, or plainer and as good but for a small part; both in runs or torques.

    The hold is one cause for all motors, delays are one for each. They are a little better for it where the logged inputs are noisy: half
    a sample late, straight lines are the mean of two samples, and a lag is that of more. So what they close of the judging records
    beyond the hold counts only if it is no small part of what they close in all.

    Args:
        held: What explains the records with their inputs held.
        found: What explains them with straight lines between the samples.
        without: The same fitted without its short delays.
    """
    if type(held.problem) is not type(found.problem):  # one by runs, one by torques
        return False
    if held.final.log_posterior >= found.final.log_posterior:
        return True
    free = [sum(placed.effect.free for placed in each.final.hypothesis) for each in (held, found)]
    judge = Judge(found.problem, asked_as(found.problem, found.judging))
    none = judge.predict(without, found.predictions[-1].floor)
    left = [float(np.mean(each.excess)) for each in (held.predictions[-1], found.predictions[-1], none)]
    return free[0] < free[1] and left[0] - left[1] <= judge.settings.small * (left[2] - left[1])


def _shorter_than_a_sample(found: Explained) -> list[PlacedOnJoint]:
    """Effects of an explanation that are delays or lags of less than a sample."""
    problem, final = found.problem, found.final
    step = max(record.step for record in problem.case.identification)
    late, at = list[PlacedOnJoint](), len(problem.nominal)
    for placed in final.hypothesis:
        end = at + len(placed.effect.parameters)
        values = placed_values(placed, final.vector[at:end])
        if any(0.0 < values.get(name, 0.0) < step for name in ("delay_s", "time_constant_s")):
            late.append(placed)
        at = end
    return late
