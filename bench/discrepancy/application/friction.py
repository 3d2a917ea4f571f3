"""Dry friction in MuJoCo's own terms: ``frictionloss``, hard as a step allows, set anew before every step where its level changes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import mujoco
import numpy as np

from bench.discrepancy.application.forces import element, values_of
from bench.discrepancy.application.target import Change, Target, mobility
from bench.discrepancy.articulated_search.placements import AND
from bench.discrepancy.model.mjcf_friction import frictionloss_of
from bench.discrepancy.verdict import NamedEffect


def coulomb_friction(target: Target, effect: NamedEffect) -> Change:
    """``frictionloss``, as soft as found, otherwise as hard as the step of the model allows.

    A soft one takes the place of a loss of the model; an ideal one of a linear structure is added to it, that of a drive is the whole.
    """
    v = values_of(effect)
    item = target.joint_or_tendon(effect.where)
    own = float(item.frictionloss)
    limit = v.get("limit", v.get("friction_force", 0.0))
    soft = [v.get(name, 0.0) for name in ("creep_velocity", "lead_time")]
    level = limit if "limit" in v or any(soft) else limit + own
    _set_friction(target, item, level, soft)
    text = (
        f"frictionloss {own:.6g} -> {level:.6g}; solreffriction as hard as a step of {target.step:.3g} s lets it be"
        if not any(soft)
        else f"frictionloss {own:.6g} -> {level:.6g}, as soft as the records say"
    )
    return Change(effect.name, item.name, "native", text, ((target.kind(effect.where), item.name),))


def _set_friction(target: Target, item: Any, level: float, soft: Sequence[float] = (0.0, 0.0)) -> None:
    item.frictionloss = level

    def soften(model: mujoco.MjModel) -> None:
        found = frictionloss_of(level, *soft, mobility=mobility(model, item.name), step=target.step)
        reference = [float(x) for x in found["solreffriction"].split()]
        impedance = [float(x) for x in found["solimpfriction"].split()]
        item.solref_friction = reference
        item.solimp_friction = (*impedance, 0.001, 0.5, 2.0)

    target.later.append(soften)


def harden(spec: mujoco.MjSpec) -> None:
    """Make the dry friction of a model as hard as its step lets it be."""
    for item in (*spec.joints, *spec.tendons):
        if item.frictionloss > 0.0:
            found = frictionloss_of(
                float(item.frictionloss), 0.0, 0.0, mobility=1.0, step=float(spec.option.timestep)
            )
            item.solref_friction = [float(x) for x in found["solreffriction"].split()]
            item.solimp_friction = (*(float(x) for x in found["solimpfriction"].split()), 0.001, 0.5, 2.0)


def coupled_friction(target: Target, effect: NamedEffect) -> Change:
    """Friction and damping of a fixed tendon that moves with both joints."""
    v, (first, second) = values_of(effect), effect.where.split(AND)
    tendon = target.tendon_on(first, effect.name)
    tendon.wrap_joint(second, v["sense"])
    tendon.damping = np.append(v["damping"], np.zeros(np.size(tendon.damping) - 1))
    _set_friction(target, tendon, v["limit"])
    text = f"a tendon over '{first}' and '{second}' with a frictionloss of {v['limit']:.6g} and a damping of {v['damping']:.6g}"
    return Change(effect.name, tendon.name, "native", text, (("fixed", tendon.name),))


def _modulated(limit: Callable[[dict[str, float]], str]) -> Callable[[Target, NamedEffect], Change]:
    """Dry friction whose limit changes: ``frictionloss``, set anew before every step."""

    def change(target: Target, effect: NamedEffect) -> Change:
        item = target.joint_or_tendon(effect.where)
        if target.kind(effect.where) != "joint":
            return element(target, effect)
        own = float(item.frictionloss)
        own = 0.0 if "limit" in effect.parameters or "limit_0" in effect.parameters else own
        first = next(iter(values_of(effect).values()))
        _set_friction(target, item, own + abs(first))
        loss = f"{own:.8g} + {limit(values_of(effect))}" if own else limit(values_of(effect))
        lines = (
            f"j = model.joint({item.name!r}); dof = j.dofadr[0]; q, v = data.qpos[j.qposadr[0]], data.qvel[dof]",
            f"model.dof_frictionloss[dof] = max({loss}, 1e-12)",
        )
        text = "frictionloss whose level is set anew before every step, by before_step in the snippet"
        return Change(effect.name, item.name, "step", text, (("joint", item.name),), lines=lines)

    return change


def _stribeck_limit(v: dict[str, float]) -> str:
    level = v.get("limit", v.get("friction_force", 0.0))
    rise = v.get("rise", v.get("static_excess", 0.0))
    speed = v.get("velocity", v.get("stribeck_velocity", 1.0))
    return f"{level:.8g} * (1.0 + {rise:.8g} * math.exp(-((v / {speed:.8g}) ** 2)))"


def _carried_limit(v: dict[str, float]) -> str:
    if "mu" not in v:
        return f"{v['friction_per_displacement']:.8g} * abs(q)"
    torque = "data.qfrc_actuator" if v.get("of_actuator", 0.0) > 0.5 else "carried(model, data)"
    return f"{v['limit_0']:.8g} + {v['mu']:.8g} * abs({torque}[dof])"


def _gear_limit(v: dict[str, float]) -> str:
    drive, weight = "data.qfrc_actuator[dof]", "weighed(model, data, dof)"
    return (
        f"{v['limit_0']:.8g} + abs({v['mu_drive']:.8g} * {drive} + {v['mu_weight']:.8g} * {weight})"
        f" + {v['mu_rest']:.8g} * abs({weight}) * math.exp(-((v / {v['velocity']:.8g}) ** 2)) + {v['growth']:.8g} * {drive} ** 2"
    )


def _timed_limit(v: dict[str, float]) -> str:
    turn = f"math.sin(2.0 * math.pi * {v['frequency']:.8g} * data.time + {v['phase']:.8g})"
    return f"{v['friction_force']:.8g} * (1.0 + {v['depth']:.8g} * {turn})"


FRICTION: dict[str, Callable[[Target, NamedEffect], Change]] = {
    "coulomb_friction": coulomb_friction,
    "coupled_friction": coupled_friction,
    "stribeck_friction": _modulated(_stribeck_limit),
    "load_dependent_friction": _modulated(_carried_limit),
    "gear_friction": _modulated(_gear_limit),
    "time_varying_friction": _modulated(_timed_limit),
}
"""Dry friction of every kind."""
