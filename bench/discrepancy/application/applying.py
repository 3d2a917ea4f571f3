"""A verdict put into a model: the corrected model, what was done, and what MJCF could not hold."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import mujoco
import numpy as np
from scipy.optimize import least_squares

from bench import native
from bench.arrays import Array
from bench.discrepancy.application.contact import surface_contact
from bench.discrepancy.application.drives import DRIVES, LOGGED, logged
from bench.discrepancy.application.forces import FORCES, element
from bench.discrepancy.application.friction import FRICTION, harden
from bench.discrepancy.application.numbers import nominal_parameter, wrong_number
from bench.discrepancy.application.target import Change, Target
from bench.discrepancy.case.case import Case
from bench.discrepancy.verdict import NamedEffect, NominalEstimate
from bench.errors import ModelError
from bench.rig import Element, Rig
from bench.rig.building import parse
from bench.rig.held_joints import held, weld
from bench.rig.mjcf_files import mjcf_text

WRONG_NUMBERS = ("mass_error", "com_error", "base_tilt", "stiffness_error", "damping_error")
INTEGRATORS = {
    mujoco.mjtIntegrator.mjINT_EULER: "Euler",
    mujoco.mjtIntegrator.mjINT_RK4: "RK4",
    mujoco.mjtIntegrator.mjINT_IMPLICIT: "implicit",
    mujoco.mjtIntegrator.mjINT_IMPLICITFAST: "implicitfast",
}


@dataclass(frozen=True)
class Findings:
    """What of a verdict goes into a model: effects, and nominal parameters as re-estimated."""

    effects: tuple[NamedEffect, ...]
    nominal: tuple[NominalEstimate, ...] = ()


@dataclass(frozen=True, eq=False)
class Applied:
    """A corrected model.

    Attributes:
        spec: It, in MuJoCo's own terms as far as these go.
        changes: What was done.
        outputs: Joint to the tendon that reads its link, where its encoder sits there.
        folder: Folder of its meshes.
    """

    spec: mujoco.MjSpec
    changes: tuple[Change, ...]
    outputs: Mapping[str, str]
    folder: str

    @property
    def elements(self) -> tuple[Element, ...]:
        """Laws that run as native callbacks."""
        found = [change.element for change in self.changes if change.element is not None]
        return tuple(Element.of(law, *joints, theta=theta) for law, joints, theta in found)

    @property
    def lines(self) -> tuple[str, ...]:
        """Python that runs before every step."""
        return tuple(line for change in self.changes for line in change.lines)

    def as_tested(self, case: Case) -> Applied:
        """It as `as_tested` by a case."""
        return replace(self, spec=as_tested(self.spec, case))

    @native.quiet()
    def compiled(self) -> mujoco.MjModel:
        """The model, with its laws as native callbacks where it has such."""
        model = self.spec.compile()
        if not self.elements:
            return model
        settings = {"timestep": float(self.spec.option.timestep), "folder": self.folder}
        rig = Rig(
            "corrected",
            self.spec.to_xml(),
            self.elements,
            integrator=INTEGRATORS[self.spec.option.integrator],
            **settings,
        )
        return rig.model


def told(error: Exception) -> str:
    """A message of MuJoCo in one line."""
    return " ".join(str(error).split())


def specification(path: str | Path) -> mujoco.MjSpec:
    """Read an MJCF file.

    Raises:
        ModelError: MuJoCo does not read it, or it is beyond the limits of a model.
    """
    return parse(mjcf_text(path), str(Path(path).parent), f"'{path}'")


def as_tested(spec: mujoco.MjSpec, case: Case | None) -> mujoco.MjSpec:
    """A model as the records of a case were taken with it: a copy in which joints that were held are welded; itself where none was."""
    joints = case.options.get("joints") if case else None
    if not held(joints):
        return spec
    tested = spec.copy()
    weld(tested, joints)
    return tested


@native.quiet()
def rest_of(model: mujoco.MjModel) -> dict[str, float]:
    """Positions of the joints at which the model stays without controls, from which a linear case counts."""
    start = np.array(model.qpos0)
    data = mujoco.MjData(model)
    if model.nq != model.nv or not np.any(model.opt.gravity):
        return {}
    flags = int(model.opt.disableflags)
    model.opt.disableflags = flags | int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
    try:

        def unbalanced(q: Array) -> Array:
            data.qpos[:], data.qvel[:], data.qacc[:] = q, 0.0, 0.0
            mujoco.mj_inverse(model, data)
            return np.array(data.qfrc_inverse)

        if np.max(np.abs(unbalanced(start))) < 1e-12:
            return {}
        found = np.asarray(least_squares(unbalanced, start, xtol=1e-14, ftol=1e-14, gtol=1e-14).x)
    finally:
        model.opt.disableflags = flags
    moved = np.abs(found - start) > 1e-9
    return {
        model.joint(i).name: float(found[model.jnt_qposadr[i]])
        for i in range(model.njnt)
        if moved[model.jnt_qposadr[i]]
    }


def loads_of(case: Case | None, model: mujoco.MjModel) -> dict[str, str]:
    """Load channel to actuator."""
    sensors = {
        model.sensor(i).name: model.actuator(int(model.sensor_objid[i])).name
        for i in range(model.nsensor)
        if int(model.sensor_type[i]) == int(mujoco.mjtSensor.mjSENS_ACTUATORFRC)
    }
    out = dict(sensors)
    for channel in case.channels if case else ():
        kind, _, name = channel.target.rpartition(":")
        name = name or channel.name
        if kind in ("", "actuator", "sensor"):
            out[channel.name] = sensors.get(name, name)
    return out


class RunOptions(NamedTuple):
    """How the corrected model is simulated where that differs from the user's own options.

    Attributes:
        step: Step [s].
        integrator: Integrator.
        hard: Dry friction of the model as hard as the step lets it be, whatever it says itself.
    """

    step: float | None = None
    integrator: mujoco.mjtIntegrator | None = None
    hard: bool = False


@native.quiet()
def apply(
    path: str | Path,
    findings: Findings,
    *,
    case: Case | None = None,
    linear: bool = True,
    options: RunOptions | None = None,
) -> Applied:
    """Put what was found into a model.

    Args:
        path: The MJCF.
        findings: Effects and parameters.
        case: The case behind them, which says what its channels and places stand for.
        linear: Whether positions are counted from rest.
        options: Other options of the simulation.

    Raises:
        ModelError: The model cannot be read or compiled with the changes.
        UnknownNameError: It lacks what an effect refers to.
    """
    spec = specification(path)
    own = options or RunOptions()
    if own.step is not None:
        spec.option.timestep = own.step
    if own.integrator is not None:
        spec.option.integrator = own.integrator
    if own.hard:
        harden(spec)
    tested = as_tested(spec, case)
    try:
        nominal = spec.compile()
        moved = nominal if tested is spec else tested.compile()
    except ValueError as error:
        raise ModelError(f"'{path}' is no MJCF that MuJoCo compiles: {told(error)}") from None
    places = case.options.get("places", ()) if case else ()
    named = tuple(str(p) for p in places) if isinstance(places, (list, tuple)) else ()
    sampling = case.identification[0].step if case else 0.0
    rest = rest_of(moved) if linear else {}
    target = Target(spec, nominal, rest, loads_of(case, nominal), named, sampling)
    known = {estimate.name for estimate in findings.nominal}
    changes = [nominal_parameter(target, estimate) for estimate in findings.nominal]
    changes += [_one(target, effect, known) for effect in _ordered(findings.effects)]
    try:
        target.finish()
        spec.compile()
    except ValueError as error:
        raise ModelError(f"the model does not compile with what was found: {told(error)}") from None
    return Applied(spec, tuple(changes), target.outputs, str(Path(path).parent))


AT_JOINTS = FORCES | FRICTION | {"surface_contact": surface_contact}
"""Effects at joints, and at the end of a tree of bodies, that have a form in MuJoCo other than a law."""


def _ordered(effects: Sequence[NamedEffect]) -> list[NamedEffect]:
    """Numbers first, trains of drives last: they divide what is there."""
    return sorted(
        effects, key=lambda e: (e.name in ("backlash", "joint_compliance"), e.name not in WRONG_NUMBERS)
    )


def _one(target: Target, effect: NamedEffect, nominal: set[str]) -> Change:
    if effect.name in WRONG_NUMBERS:
        return wrong_number(target, effect, nominal)
    if effect.name in DRIVES:
        return DRIVES[effect.name](target, effect)
    if effect.name.startswith(LOGGED):
        return logged(target, effect)
    return AT_JOINTS.get(effect.name, element)(target, effect)
