"""The user's model while effects are put into it, and what was changed."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

import mujoco
import numpy as np

from bench.errors import ModelError, UnknownNameError

Form = Literal["native", "callback", "step", "log", "number", "none"]
PREFIX = "added_"
"""Beginning of the names of joints and tendons that an effect adds."""


@dataclass(frozen=True)
class TargetSettings:
    """Numbers of `bench.discrepancy.application.target`."""

    spring_impedance: float = 1e-4
    """Impedance (mjMINIMP) at which a limit is the spring and damper that its negative solref says, and moves nothing but its force."""
    far: float = 1e6
    """Limit that no motion reaches, of a stop that has one side only."""


TARGET_SETTINGS = TargetSettings()


@dataclass(frozen=True)
class Change:
    """What became of an effect or a nominal parameter.

    Attributes:
        what: The effect or parameter.
        where: Where it sits.
        form: "native" MJCF; "number" of the model; a law as native "callback"; Python before every "step"; the "log", which is
            what was wrong; "none" where nothing here can hold it.
        text: What was done, in words, with the numbers.
        anchors: Kind and name of the elements of the MJCF that the text belongs to as a comment.
        element: Law, joints and theta of a callback.
        lines: Python, run before every step with `model` and `data` in reach.
    """

    what: str
    where: str
    form: Form
    text: str
    anchors: tuple[tuple[str, str], ...] = ()
    element: tuple[str, tuple[str, ...], tuple[float, ...]] | None = None
    lines: tuple[str, ...] = ()

    def to_json(self) -> dict[str, Any]:
        """The change as JSON values."""
        return {"what": self.what, "where": self.where, "form": self.form, "text": self.text}


@dataclass(eq=False)
class Target:
    """A model that is being corrected.

    Attributes:
        spec: The model; changed in place.
        nominal: The model as it came, compiled.
        rest: Joint to the position at rest, from which a linear case counts its motion; zero where a joint is not listed.
        loads: Load channel to actuator.
        places: Places of effects that say no place.
        sampling: Time between samples of the case's records [s]; 0 where no case is given.
        outputs: Joint to the tendon that reads its link, where the encoder sits behind an elastic train.
        later: What is set once everything else is, given the model compiled then: numbers that depend on inertia.
    """

    spec: mujoco.MjSpec
    nominal: mujoco.MjModel
    rest: Mapping[str, float] = field(default_factory=dict)
    loads: Mapping[str, str] = field(default_factory=dict)
    places: tuple[str, ...] = ()
    sampling: float = 0.0
    outputs: dict[str, str] = field(default_factory=dict)
    later: list[Callable[[mujoco.MjModel], None]] = field(default_factory=list)

    @property
    def step(self) -> float:
        """Step of the simulation [s]."""
        return float(self.spec.option.timestep)

    def joint_or_tendon(self, name: str) -> Any:
        """The joint or tendon of a place; the only joint where it has no name.

        Raises:
            UnknownNameError: There is none.
        """
        found = self.spec.joint(self.named(name)) or self.spec.tendon(self.named(name))
        if found is None:
            raise UnknownNameError("joint or tendon of the model", name, self._names())
        return found

    def named(self, name: str) -> str:
        """Name of a place, that of the only joint where it has none.

        Raises:
            ModelError: The place has no name and the model several joints.
        """
        if name:
            return name
        if len(self.places) == 1:
            return self.places[0]
        joints = [joint.name for joint in self.spec.joints]
        if len(joints) != 1 or not joints[0]:
            raise ModelError(
                "the verdict says no place and the model has not one named joint; give the case folder (--case), which says the place"
            )
        return joints[0]

    def _names(self) -> list[str]:
        return [x.name for x in (*self.spec.joints, *self.spec.tendons) if x.name]

    def kind(self, name: str) -> str:
        """ "joint", or "fixed" of a tendon, as MJCF calls them."""
        return "joint" if self.spec.joint(self.named(name)) is not None else "fixed"

    def angle(self, name: str) -> float:
        """What an angle of this joint in radians is multiplied by in the model: MJCF may count in degrees."""
        joint = self.spec.joint(self.named(name))
        turns = joint is not None and joint.type == mujoco.mjtJoint.mjJNT_HINGE
        return 180.0 / np.pi if turns and self.spec.compiler.degree else 1.0

    def finish(self) -> None:
        """Set what depends on the inertia of the corrected model."""
        if self.later:
            model = self.spec.compile()
            for setting in self.later:
                setting(model)
            self.later.clear()

    def stop(
        self, place: str, limits: tuple[float, float], stiffness: float, damping: float, *, own: bool
    ) -> str:
        """Give a place stops that are springs with dampers and never pull, exactly; return the name of what carries them.

        MuJoCo's limit of impedance d pushes with about ``d / (1 - d) (a_ref - a) / A``, A the inverse inertia of the joint and
        ``a_ref = -b v - d k r``, where ``k = -solref[0] / d^2`` and ``b = -solref[1] / d``. For d to zero that is
        ``-(K r + C v)`` with ``solref = (-K A, -C A)``, whatever else acts on the joint (MuJoCo documentation, Computation,
        "Parameters").

        Args:
            place: Joint.
            limits: Lower and upper limit [m or rad].
            stiffness: K [N/m or N m/rad].
            damping: C.
            own: Use the joint's own range; otherwise, or where it has one, a tendon on it.
        """
        item: Any = self.joint_or_tendon(place)
        kind, angle = self.kind(place), self.angle(place)
        i = mujoco.mj_name2id(self.nominal, mujoco.mjtObj.mjOBJ_JOINT, item.name)
        if (
            not own
            or item.limited == mujoco.mjtLimited.mjLIMITED_TRUE
            or (i >= 0 and self.nominal.jnt_limited[i])
        ):
            item, kind, angle = self.tendon_on(place, "stop"), "fixed", 1.0
        name = item.name
        item.range = (limits[0] * angle, limits[1] * angle)
        item.limited = mujoco.mjtLimited.mjLIMITED_TRUE
        item.solimp_limit = (
            TARGET_SETTINGS.spring_impedance,
            TARGET_SETTINGS.spring_impedance,
            0.001,
            0.5,
            2.0,
        )
        item.margin = 0.0

        def reference(model: mujoco.MjModel) -> None:
            weight = mobility(model, name)
            item.solref_limit = (-stiffness * weight, -damping * weight)

        self.later.append(reference)
        return f"{kind}:{name}"

    def at_rest(self, name: str) -> float:
        """Position of a place from which the case counts."""
        return float(self.rest.get(self.named(name), 0.0))

    def actuator(self, name: str) -> Any:
        """An actuator by its name, or by the load channel that stands for it.

        Raises:
            UnknownNameError: There is none.
        """
        found = self.spec.actuator(self.loads.get(name, name))
        if found is None and len(self.spec.actuators) == 1:
            found = self.spec.actuators[0]
        if found is None:
            raise UnknownNameError("actuator of the model", name, [a.name for a in self.spec.actuators])
        return found

    def body(self, name: str) -> Any:
        """A body by its name, its inertia written out.

        Raises:
            UnknownNameError: There is none.
        """
        body = self.spec.body(name)
        if body is None:
            raise UnknownNameError("body of the model", name, [b.name for b in self.spec.bodies])
        if self.spec.compiler.inertiafromgeom == mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_TRUE:
            for other in self.spec.bodies:
                if other.name and other.name != "world":
                    self._written_out(other)
            self.spec.compiler.inertiafromgeom = mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_AUTO
        self._written_out(body)
        return body

    def _written_out(self, body: Any) -> None:
        if body.explicitinertial:
            if np.isfinite(body.fullinertia[0]) or body.ialt.type != mujoco.mjtOrientation.mjORIENTATION_QUAT:
                self._copy_inertia(body)
            return
        self._copy_inertia(body)
        body.explicitinertial = True

    def _copy_inertia(self, body: Any) -> None:
        i = self.nominal.body(body.name).id
        body.mass = float(self.nominal.body_mass[i])
        body.ipos, body.iquat = self.nominal.body_ipos[i], self.nominal.body_iquat[i]
        body.inertia = self.nominal.body_inertia[i]
        body.fullinertia = np.full(6, np.nan)
        body.ialt.type = mujoco.mjtOrientation.mjORIENTATION_QUAT

    def tendon_on(self, place: str, effect: str) -> Any:
        """A new fixed tendon that is a joint, for what the joint itself cannot hold.

        Raises:
            ModelError: The place is a tendon already.
        """
        name = self.named(place)
        if self.spec.joint(name) is None:
            raise ModelError(f"{effect} on the tendon '{name}' has no form in MJCF; put it onto a joint")
        label, number = f"{PREFIX}{name}_{effect}", 1
        while self.spec.tendon(label) is not None:
            number += 1
            label = f"{PREFIX}{name}_{effect}_{number}"
        tendon = self.spec.add_tendon(name=label)
        tendon.wrap_joint(name, 1.0)
        as_mujoco(tendon)
        return tendon


def mobility(model: mujoco.MjModel, name: str) -> float:
    """Inverse inertia of a joint or tendon at the reference position, as MuJoCo's constraints see it."""
    i = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, name)
    if i >= 0:
        return float(model.dof_invweight0[model.jnt_dofadr[i]])
    return float(model.tendon_invweight0[model.tendon(name).id])


def with_first(item: Any, **values: float) -> None:
    """Set the linear coefficient of polynomials of a joint or tendon, its stiffness or damping, by their names."""
    for attribute, value in values.items():
        coefficients = np.array(getattr(item, attribute), dtype=float)
        coefficients[0] = value
        setattr(item, attribute, coefficients)


def as_mujoco(item: Any) -> None:
    """Give a new joint, tendon or actuator MuJoCo's own defaults: the user's default classes are meant for others."""
    if hasattr(item, "dyntype"):
        plain = mujoco.MjSpec().add_actuator(name="plain")
        kept = ("name", "target", "trntype")
    elif hasattr(item, "wrap_joint"):
        plain = mujoco.MjSpec().add_tendon(name="plain")
        kept = ("name",)
    else:
        plain = mujoco.MjSpec().worldbody.add_body().add_joint(name="plain")
        kept = ("name", "type", "axis", "pos", "parent", "frame")
    own = {"classname", "info", "userdata", *kept}
    for key in dir(plain):
        entry = getattr(type(plain), key)
        if (
            not key.startswith("_")
            and key not in own
            and isinstance(entry, property)
            and entry.fset is not None
        ):
            setattr(item, key, getattr(plain, key))
