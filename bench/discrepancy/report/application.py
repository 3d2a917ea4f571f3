"""How a found effect goes back into a model: as an element in code, as rig configuration, and as MJCF where MuJoCo has it."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

from bench.discrepancy.verdict import NamedEffect

if TYPE_CHECKING:
    from bench.discrepancy.diagnosis import Diagnosis


class Recipe(NamedTuple):
    """An effect, ready to be pasted.

    Attributes:
        title: Effect, and where it sits.
        equation: What is added to the equation of motion, with its numbers.
        code: Python that makes the element; empty for effects that are no force law.
        toml: The same as rig configuration.
        mjcf: The same in MuJoCo's own elements; empty where MuJoCo has none.
        note: What to know about it.
    """

    title: str
    equation: str
    code: str
    toml: str
    mjcf: str
    note: str


def recipes(diagnosis: Diagnosis) -> list[Recipe]:
    """Return how each named effect goes back into the model."""
    estimates = nominal_estimates(diagnosis)
    return [_recipe(effect, estimates, diagnosis) for effect in diagnosis.verdict.named]


def nominal_estimates(diagnosis: Diagnosis) -> dict[str, float]:
    """Nominal parameters as re-estimated together with the effects."""
    out: dict[str, float] = {}
    for part, fitted in diagnosis.explanations[0].parts:
        values, _ = part.split(fitted.hypothesis, fitted.vector)
        out.update(dict(zip(part.structure.parameters, (float(v) for v in values), strict=True)))
    return out


def _recipe(effect: NamedEffect, estimates: dict[str, float], diagnosis: Diagnosis) -> Recipe:
    joint = _joint(effect, diagnosis)
    where = effect.where or effect.channel
    title = f"{effect.name}{f' ({where})' if where else ''}"
    numbers = ", ".join(f"{n} = {e.value:.5g} {e.unit}".rstrip() for n, e in effect.parameters.items())
    mjcf, note = _mjcf(effect, estimates, diagnosis, joint)
    return Recipe(
        title,
        f"{effect.equation}   with {numbers}",
        element_code(effect.law, effect.theta, joint) if effect.law else "",
        element_toml(effect.law, effect.theta, joint) if effect.law else "",
        mjcf,
        note,
    )


def _joint(effect: NamedEffect, diagnosis: Diagnosis) -> tuple[str, ...]:
    """Joints of the effect: those of the bench's own rigs, or of the user's model."""
    if diagnosis.case.rig == "sdof":
        return ("carriage",)
    if diagnosis.case.rig == "damper":
        return ("piston",)
    if effect.where == "joint":
        return ("axial", "torsional")
    return (effect.where or "JOINT",)


def element_code(law: str, theta: tuple[float, ...], joints: tuple[str, ...] = ("JOINT",)) -> str:
    """Python code that makes the element of a found effect."""
    from bench.laws import find_law  # noqa: PLC0415  (laws import their kernels)

    names = ", ".join(f'"{joint}"' for joint in joints)
    numbers = ", ".join(
        f"{name}={value:.6g}" for name, value in zip(find_law(law).parameter_names, theta, strict=True)
    )
    return f'from bench.rig import Element\n\nelement = Element.of("{law}", {names}, {numbers})\nrig = rig.with_element(element)'


def element_toml(law: str, theta: tuple[float, ...], joints: tuple[str, ...] = ("JOINT",)) -> str:
    """The element of a found effect as an entry of a rig configuration."""
    from bench.laws import find_law  # noqa: PLC0415

    names = ", ".join(f'"{joint}"' for joint in joints)
    numbers = ", ".join(
        f"{name} = {_toml_number(value)}"
        for name, value in zip(find_law(law).parameter_names, theta, strict=True)
    )
    return f'[[elements]]\nlaw = "{law}"\njoints = [{names}]\nparameters = {{ {numbers} }}'


def _toml_number(value: float) -> str:
    if not math.isfinite(value):
        return "inf" if value > 0 else "-inf"
    text = f"{value:.6g}"
    return text if any(c in text for c in ".en") else text + ".0"


def _mjcf(
    effect: NamedEffect, estimates: dict[str, float], diagnosis: Diagnosis, joint: tuple[str, ...]
) -> tuple[str, str]:
    """MuJoCo's own form of an effect, and what to know about it."""
    maker = _NATIVE.get(effect.name)
    if maker is None:
        return "", "MuJoCo has no native form of it; use the element." if effect.law else ""
    place = next((p for p in diagnosis.problem.structure.places if p.name == effect.where), None)
    stiffness = estimates.get(place.stiffness, 0.0) if place else 0.0
    damping = estimates.get(place.damping, 0.0) if place else 0.0
    own = _Own(joint[0], stiffness, damping, diagnosis.case.identification[0].step)
    return maker(effect, own)


class _Own(NamedTuple):
    """What the joint has already: its name, stiffness and damping; and the step of the records [s]."""

    joint: str
    stiffness: float
    damping: float
    step: float


def _first(effect: NamedEffect) -> float:
    return next(iter(effect.parameters.values())).value


def _friction(effect: NamedEffect, own: _Own) -> tuple[str, str]:
    return (
        f'<joint name="{own.joint}" frictionloss="{_first(effect):.6g}"/>',
        "MuJoCo's constraint holds the joint at rest, as real friction does; the element rounds the sign function instead.",
    )


def _cubic(effect: NamedEffect, own: _Own) -> tuple[str, str]:
    return (
        f'<joint name="{own.joint}" stiffness="{own.stiffness:.6g} 0 {_first(effect):.6g}"/>',
        "The first number is the linear stiffness as re-estimated.",
    )


def _quadratic(effect: NamedEffect, own: _Own) -> tuple[str, str]:
    return (
        f'<joint name="{own.joint}" stiffness="{own.stiffness:.6g} {_first(effect):.6g}"/>',
        "The first number is the linear stiffness as re-estimated.",
    )


def _quadratic_damping(effect: NamedEffect, own: _Own) -> tuple[str, str]:
    return (
        f'<joint name="{own.joint}" damping="{own.damping:.6g} {_first(effect):.6g}"/>',
        "The first number is the viscous damping as re-estimated; the second multiplies v |v|.",
    )


def _parameter(attribute: str) -> Callable[[NamedEffect, _Own], tuple[str, str]]:
    def make(effect: NamedEffect, own: _Own) -> tuple[str, str]:
        value = own.stiffness if attribute == "stiffness" else own.damping
        return (
            f'<joint name="{own.joint}" {attribute}="{value:.6g}"/>',
            "A number of the model was wrong, nothing else.",
        )

    return make


def _mass(effect: NamedEffect, own: _Own) -> tuple[str, str]:
    return (
        f'<inertial mass="{1.0 + _first(effect):.6g} * (mass in the model)" … />',
        f"The body moved by {effect.channel or own.joint} is {100 * _first(effect):+.3g} % off; change its inertial or its geoms.",
    )


def _actuator_delay(effect: NamedEffect, own: _Own) -> tuple[str, str]:
    delay = _first(effect)
    return (
        f'<general name="ACTUATOR" joint="{own.joint}" delay="{delay:.6g}" nsample="{_samples(delay, own)}"/>',
        "nsample is the length of MuJoCo's buffer in steps of the simulation; here for the step of the records.",
    )


def _samples(delay: float, own: _Own) -> int:
    return math.ceil(delay / own.step) + 1


def _actuator_lag(effect: NamedEffect, own: _Own) -> tuple[str, str]:
    return (
        f'<general name="ACTUATOR" joint="{own.joint}" dyntype="filterexact" dynprm="{_first(effect):.6g}"/>',
        "",
    )


def _gain(effect: NamedEffect, own: _Own) -> tuple[str, str]:
    return (
        f'<general name="ACTUATOR" joint="{own.joint}" gainprm="{1.0 + _first(effect):.6g}"/>',
        "Relative to a gain of one; multiply the actuator's own.",
    )


def _saturation(effect: NamedEffect, own: _Own) -> tuple[str, str]:
    level = abs(_first(effect))
    return (
        f'<general name="ACTUATOR" joint="{own.joint}" forcelimited="true" forcerange="{-level:.6g} {level:.6g}"/>',
        "",
    )


def _sensor_delay(effect: NamedEffect, own: _Own) -> tuple[str, str]:
    delay = _first(effect)
    return (
        f'<jointpos name="{effect.channel}" joint="{own.joint}" delay="{delay:.6g}" nsample="{_samples(delay, own)}"/>',
        "The mechanics are as modelled: the sensor is late.",
    )


def _sensor_clip(effect: NamedEffect, own: _Own) -> tuple[str, str]:
    return (
        f'<jointpos name="{effect.channel}" joint="{own.joint}" cutoff="{abs(_first(effect)):.6g}"/>',
        "The mechanics are as modelled: the sensor saturates.",
    )


_NATIVE: dict[str, Callable[[NamedEffect, _Own], tuple[str, str]]] = {
    "coulomb_friction": _friction,
    "cubic_stiffness": _cubic,
    "quadratic_stiffness": _quadratic,
    "quadratic_damping": _quadratic_damping,
    "stiffness_error": _parameter("stiffness"),
    "damping_error": _parameter("damping"),
    "mass_error": _mass,
    "actuator_delay": _actuator_delay,
    "actuator_lag": _actuator_lag,
    "force_gain_error": _gain,
    "actuator_saturation": _saturation,
    "displacement_delay": _sensor_delay,
    "displacement_clipping": _sensor_clip,
}
"""Effects that MuJoCo has natively, by name."""
