"""How a found effect goes back into a model: as an element in code, as rig configuration, and as MJCF where MuJoCo has it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

from bench.discrepancy.model.mjcf_friction import frictionloss_of
from bench.discrepancy.verdict import NamedEffect
from bench.laws.carried_mass import spring_and_damper

if TYPE_CHECKING:
    from bench.discrepancy.diagnosis import Diagnosis


FRICTION = ("friction_force", "creep_velocity", "lead_time")
"""Parameters of dry friction, those of its softness where it has any."""


class PastedEffect(NamedTuple):
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


def recipes(diagnosis: Diagnosis) -> list[PastedEffect]:
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


def _recipe(effect: NamedEffect, estimates: dict[str, float], diagnosis: Diagnosis) -> PastedEffect:
    joint = _joint(effect, diagnosis)
    where = effect.where or effect.channel
    title = f"{effect.name}{f' ({where})' if where else ''}"
    numbers = ", ".join(f"{n} = {e.value:.5g} {e.unit}".rstrip() for n, e in effect.parameters.items())
    mjcf, note = _mjcf(effect, estimates, diagnosis, joint)
    return PastedEffect(
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
    names = ", ".join(f'"{joint}"' for joint in joints)
    header, values = _sized(law, theta)
    numbers = ", ".join(f"{name}={value:.6g}" for name, value in values.items())
    entry = f'find_law("{law}", {header})' if header else f'"{law}"'
    imports = "from bench.laws import find_law\n" if header else ""
    return (
        f"{imports}from bench.rig import Element\n\nelement = Element.of({entry}, {names}, {numbers})\n"
        "rig = rig.with_element(element)"
    )


def _sized(law: str, theta: tuple[float, ...]) -> tuple[tuple[float, ...], dict[str, float]]:
    """Header of a law in the size of a theta, and its parameters by name."""
    from bench.laws import find_law  # noqa: PLC0415  (laws import their kernels)

    header = theta[: len(find_law(law).header)]
    values = theta[len(header) :]
    return header, dict(zip(find_law(law, header).parameter_names, values, strict=True))


def element_toml(law: str, theta: tuple[float, ...], joints: tuple[str, ...] = ("JOINT",)) -> str:
    """The element of a found effect as an entry of a rig configuration."""
    names = ", ".join(f'"{joint}"' for joint in joints)
    header, values = _sized(law, theta)
    numbers = ", ".join(f"{name} = {_toml_number(value)}" for name, value in values.items())
    size = f"header = [{', '.join(_toml_number(x) for x in header)}]\n" if header else ""
    return f'[[elements]]\nlaw = "{law}"\n{size}joints = [{names}]\nparameters = {{ {numbers} }}'


def _toml_number(value: float) -> str:
    if not math.isfinite(value):
        return "inf" if value > 0 else "-inf"
    text = f"{value:.6g}"
    return text if any(c in text for c in ".en") else text + ".0"


def _mjcf(
    effect: NamedEffect, estimates: dict[str, float], diagnosis: Diagnosis, joint: tuple[str, ...]
) -> tuple[str, str]:
    """MuJoCo's own form of an effect, and what to know about it."""
    native = _NATIVE.get(effect.name)
    if native is None:
        return "", "MuJoCo has no native form of it; use the element." if effect.law else ""
    place = next((p for p in diagnosis.problem.structure.places if effect.where in {p.name, p.site}), None)
    stiffness = estimates.get(place.stiffness, 0.0) if place else 0.0
    damping = estimates.get(place.damping, 0.0) if place else 0.0
    own = _Own(effect, joint[0], stiffness, damping, diagnosis.case.identification[0].step)
    if place is not None and not diagnosis.problem.driven:
        own = own._replace(mobility=diagnosis.problem.scales(place).mobility)
    return native.text.format(own), native.note.format(own)


class _Own(NamedTuple):
    """An effect, and what its joint has already: name, stiffness, damping, and mobility; and the step of the records [s]."""

    effect: NamedEffect
    joint: str
    stiffness: float
    damping: float
    step: float
    mobility: float = 1.0

    @property
    def friction(self) -> str:
        """MuJoCo's attributes of dry friction of the effect's softness; as hard as its step lets it be where that is none."""
        numbers = [self.effect.parameters[n].value if n in self.effect.parameters else 0.0 for n in FRICTION]
        attributes = frictionloss_of(*numbers, mobility=self.mobility, step=self.step)
        return " ".join(f'{name}="{value}"' for name, value in attributes.items())

    @property
    def value(self) -> float:
        """The effect's first parameter."""
        return next(iter(self.effect.parameters.values())).value

    @property
    def magnitude(self) -> float:
        return abs(self.value)

    @property
    def factor(self) -> float:
        """What the effect multiplies by, its parameter being an error relative to one."""
        return 1.0 + self.value

    @property
    def percent(self) -> float:
        return 100.0 * self.value

    @property
    def samples(self) -> int:
        """Length of MuJoCo's buffer for a delay, in steps of the records."""
        return math.ceil(self.value / self.step) + 1

    @property
    def spring(self) -> tuple[float, float]:
        """Stiffness and damping of the spring under a mass that the joint carries."""
        return spring_and_damper(*self.effect.theta)

    @property
    def moved(self) -> str:
        """The channel or nominal parameter that the effect acts on; the joint where it names none."""
        return self.effect.channel or self.joint


class _Native(NamedTuple):
    """MuJoCo's own form of an effect and what to know about it: texts to be filled in from an `_Own`."""

    text: str
    note: str = ""


_NATIVE: dict[str, _Native] = {
    "coulomb_friction": _Native(
        '<joint name="{0.joint}" {0.friction}/>',
        "MuJoCo's constraint creeps at rest; these numbers make it as soft as the records say, or else as hard as a step of "
        "{0.step:.3g} s lets it be: its defaults turn the force round 9.5 ms early. They take the place of a frictionloss that is there.",
    ),
    "cubic_stiffness": _Native(
        '<joint name="{0.joint}" stiffness="{0.stiffness:.6g} 0 {0.value:.6g}"/>',
        "The first number is the linear stiffness as re-estimated.",
    ),
    "quadratic_stiffness": _Native(
        '<joint name="{0.joint}" stiffness="{0.stiffness:.6g} {0.value:.6g}"/>',
        "The first number is the linear stiffness as re-estimated.",
    ),
    "quadratic_damping": _Native(
        '<joint name="{0.joint}" damping="{0.damping:.6g} {0.value:.6g}"/>',
        "The first number is the viscous damping as re-estimated; the second multiplies v |v|.",
    ),
    "stiffness_error": _Native(
        '<joint name="{0.joint}" stiffness="{0.stiffness:.6g}"/>',
        "A number of the model was wrong, nothing else.",
    ),
    "damping_error": _Native(
        '<joint name="{0.joint}" damping="{0.damping:.6g}"/>',
        "A number of the model was wrong, nothing else.",
    ),
    "carried_mass": _Native(
        '<body name="CARRIED"> <joint type="(as {0.joint})" axis="(as {0.joint})" stiffness="{0.spring[0]:.6g}" '
        'damping="{0.spring[1]:.6g}"/> '
        '<inertial mass="{0.effect.theta[0]:.6g}" … /> </body>',
        "A child of the body that {0.joint} moves, which loses as much: jointbench apply divides it. Of a hinge the number is an inertia.",
    ),
    "mass_error": _Native(
        '<inertial mass="{0.factor:.6g} * (mass in the model)" … />',
        "The body moved by {0.moved} is {0.percent:+.3g} % off; change its inertial or its geoms.",
    ),
    "actuator_delay": _Native(
        '<general name="ACTUATOR" joint="{0.joint}" delay="{0.value:.6g}" nsample="{0.samples}"/>',
        "nsample is the length of MuJoCo's buffer in steps of the simulation; here for the step of the records.",
    ),
    "actuator_lag": _Native(
        '<general name="ACTUATOR" joint="{0.joint}" dyntype="filterexact" dynprm="{0.value:.6g}"/>',
    ),
    "force_gain_error": _Native(
        '<general name="ACTUATOR" joint="{0.joint}" gainprm="{0.factor:.6g}"/>',
        "Relative to a gain of one; multiply the actuator's own.",
    ),
    "actuator_saturation": _Native(
        '<general name="ACTUATOR" joint="{0.joint}" forcelimited="true" forcerange="-{0.magnitude:.6g} {0.magnitude:.6g}"/>',
    ),
    "displacement_delay": _Native(
        '<jointpos name="{0.effect.channel}" joint="{0.joint}" delay="{0.value:.6g}" nsample="{0.samples}"/>',
        "The mechanics are as modelled: the sensor is late.",
    ),
    "displacement_clipping": _Native(
        '<jointpos name="{0.effect.channel}" joint="{0.joint}" cutoff="{0.magnitude:.6g}"/>',
        "The mechanics are as modelled: the sensor saturates.",
    ),
}
"""Effects that MuJoCo has natively, by name."""
