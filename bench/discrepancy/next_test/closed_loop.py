"""The question which of two explanations holds, asked of the planner that shapes the force while it measures (`jointbench excite`).

An excitation that is chosen beforehand has to suit both explanations wherever they may lie; the planner reads off the record so far
which rig it has before it, and decides sooner (docs/excitation.md).
"""

from __future__ import annotations

from typing import Any

from bench.discrepancy.case.single_axis import load_channel, motion_channels, turns
from bench.discrepancy.judgement.posterior import effects_of
from bench.discrepancy.likelihood.problem import Problem
from bench.discrepancy.model.placement import Placed
from bench.discrepancy.next_test.feasible_excitations import band_about, limits_of, resonance
from bench.discrepancy.search.explanation import Explanation
from bench.discrepancy.verdict import NamedEffect
from bench.laws import find_law

RIG, JOINT, SHAKER = "sdof", "carriage", "shaker"
"""The bench's oscillator, and what it calls its joint and its actuator."""
MEASURED = ("displacement", "velocity", "acceleration_x")
"""Its channels, by the order of the derivative."""
STRUCTURE = ("mass", "stiffness", "damping")
"""Its parameters."""


def closed_loop(problem: Problem, first: Explanation, second: Explanation) -> dict[str, Any]:
    """The rig of the first explanation and the second as its rival, as `jointbench excite --method planner` takes them.

    Empty where the case is none of an oscillator of the bench in SI units, or an explanation holds more than force laws.
    """
    case = problem.case
    plain = case.rig == RIG and not turns(case) and {p.name for p in case.parameters} <= set(STRUCTURE)
    named = [effects_of(explanation, {}) for explanation in (first, second)]
    if (
        not plain
        or problem.driven
        or not all(named)
        or not all(map(_goes_into_a_rig, (*first.hypothesis, *second.hypothesis)))
    ):
        return {}
    load, motion = load_channel(case), motion_channels(case)
    units = {load: "N"} | dict(zip(motion.values(), ("m", "m/s", "m/s^2"), strict=False))
    if any(case.channel(name).unit not in ("", unit) for name, unit in units.items()):
        return {}
    limits, record = limits_of(problem), max(problem.records, key=len)
    (low, high), duration = band_about(resonance(problem, 0)), len(record) * record.step
    noise = dict(zip(problem.structure.channels, problem.noise.tolist(), strict=True))
    ours = {MEASURED[order]: name for order, name in motion.items()}
    part, fitted = first.parts[0]
    values = dict(
        zip(part.structure.parameters, part.split(fitted.hypothesis, fitted.vector)[0].tolist(), strict=False)
    )
    watched = {
        kind: ours[name] for kind, name in zip(("stroke", "velocity"), MEASURED, strict=False) if name in ours
    }
    return {
        "rig": RIG,
        "timestep": record.step,
        "structure": {name: {JOINT: values.get(name, 0.0)} for name in STRUCTURE},
        "elements": [_element(effect) for effect in named[0]],
        "experiment": {
            "duration": duration,
            "band": [max(low, 1.0 / duration), min(high, 0.4 / record.step)],
            "force": {SHAKER: limits.load[load]},
            **{
                kind: {name: limits.motion[channel]}
                for (kind, channel), name in zip(watched.items(), MEASURED, strict=False)
            },
            "noise": {name: noise[channel] for name, channel in ours.items()},
            "uncertain": _ranges(named[0]),
            "rival": {"elements": [_element(effect) for effect in named[1]], "uncertain": _ranges(named[1])},
        },
    }


def _goes_into_a_rig(placed: Placed) -> bool:
    """Whether an effect is a force law that is the same in every record."""
    effect = placed.effect
    return (
        effect.law is not None
        and effect.of_record is None
        and effect.schedule is None
        and not effect.in_place
    )


def _element(effect: NamedEffect) -> dict[str, Any]:
    return {"law": effect.law, "joints": [JOINT], "name": effect.name, "theta": list(effect.theta)}


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
