"""The question which of two explanations holds, asked of the planner that shapes the force while it measures (`jointbench excite`).

An excitation that is chosen beforehand has to suit both explanations wherever they may lie; the planner reads off the record so far
which rig it has before it, and decides sooner (docs/excitation.md).
"""

from __future__ import annotations

from typing import Any

from bench.discrepancy.case.single_axis import load_channel, motion_channels, turns
from bench.discrepancy.judgement.closing import nominal_estimates
from bench.discrepancy.judgement.posterior import effects_of
from bench.discrepancy.likelihood.problem import Problem
from bench.discrepancy.model.placement import Placed
from bench.discrepancy.next_test.feasible_excitations import band_about, limits_of, resonance
from bench.discrepancy.search.explanation import Explanation
from bench.discrepancy.verdict import NamedEffect
from bench.laws import find_law

RIG, SHAKER = "sdof", "shaker"
"""The bench's oscillator, and what it calls its actuator."""
MEASURED = (("displacement", "m"), ("velocity", "m/s"), ("acceleration_x", "m/s^2"))
"""Its channels and their units, by the order of the derivative."""
STRUCTURE = ("mass", "stiffness", "damping")
"""Its parameters."""


def closed_loop(problem: Problem, first: Explanation, second: Explanation) -> dict[str, Any]:
    """The rig of the first explanation and the second as its rival, as `jointbench excite --method planner` takes them.

    Empty where the case is none of an oscillator of the bench in SI units, or an explanation holds more than force laws.
    """
    effects = (*first.hypothesis, *second.hypothesis)
    if not (
        first.hypothesis
        and second.hypothesis
        and _is_the_benchs(problem)
        and all(map(_goes_into_a_rig, effects))
    ):
        return {}
    ours, rival = (effects_of(explanation, {}) for explanation in (first, second))
    joint, record, limits = (
        problem.structure.places[0].site,
        max(problem.records, key=len),
        limits_of(problem),
    )
    (low, high), duration = band_about(resonance(problem, 0)), len(record) * record.step
    channels = {MEASURED[order][0]: name for order, name in motion_channels(problem.case).items()}
    noise = dict(zip(problem.structure.channels, problem.noise.tolist(), strict=True))
    bounds = {
        kind: {name: limits.motion[channels[name]]}
        for kind, name in (("stroke", "displacement"), ("velocity", "velocity"))
        if name in channels
    }
    structure = {estimate.name: estimate.value for estimate in nominal_estimates(first)}
    structure = {p.name: p.value for p in problem.case.parameters} | structure
    return {
        "rig": RIG,
        "timestep": record.step,
        "structure": {name: {joint: structure.get(name, 0.0)} for name in STRUCTURE},
        "elements": [_element(effect, joint) for effect in ours],
        "experiment": {
            "duration": duration,
            "band": [max(low, 1.0 / duration), min(high, 0.4 / record.step)],
            "force": {SHAKER: limits.load[load_channel(problem.case)]},
            **bounds,
            "noise": {name: noise[channel] for name, channel in channels.items()},
            "uncertain": _ranges(ours),
            "rival": {"elements": [_element(effect, joint) for effect in rival], "uncertain": _ranges(rival)},
        },
    }


def _is_the_benchs(problem: Problem) -> bool:
    """Whether a case is one of the bench's oscillator, driven by a force, in SI units, of mass, spring and damper alone."""
    case = problem.case
    if (
        case.rig != RIG
        or problem.driven
        or turns(case)
        or not {p.name for p in case.parameters} <= set(STRUCTURE)
    ):
        return False
    units = {load_channel(case): "N"} | {
        name: MEASURED[order][1] for order, name in motion_channels(case).items()
    }
    return all(case.channel(name).unit in ("", unit) for name, unit in units.items())


def _goes_into_a_rig(placed: Placed) -> bool:
    """Whether an effect is a force law that is the same in every record."""
    effect = placed.effect
    return (
        effect.law is not None
        and effect.of_record is None
        and effect.schedule is None
        and not effect.in_place
    )


def _element(effect: NamedEffect, joint: str) -> dict[str, Any]:
    return {"law": effect.law, "joints": [joint], "name": effect.name, "theta": list(effect.theta)}


def _ranges(effects: tuple[NamedEffect, ...]) -> dict[str, list[float]]:
    """Three standard deviations to either side of the parameters that an effect has in common with its law, at most a half of them."""
    out = {}
    for effect in effects:
        for parameter, value in zip(find_law(effect.law).parameters, effect.theta, strict=True):
            estimate = effect.parameters.get(parameter.name)
            if estimate is None or value == 0.0:
                continue
            span = min(3.0 * estimate.std, 0.5 * abs(value))
            low, high = max(value - span, parameter.bounds[0]), min(value + span, parameter.bounds[1])
            if low < high:
                out[f"{effect.name}.{parameter.name}"] = [low, high]
    return out
