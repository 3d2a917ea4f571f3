"""The rigs of the bench: the dissertation's apparatus, ready to take elements.

Every rig is an ordinary `Rig` on one of the MJCF files in `models/`; masses, springs and dampers of the structure
are changed with `with_structure`, joints with `with_element`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import make_interp_spline

from bench.errors import ModelError, ParameterError, RecordingError
from bench.mjcf import model_path
from bench.rig.description import Rig
from bench.rig.element import Element

PRESCRIBED_ACTUATORS = ("drive_position", "drive_velocity", "drive_feedforward")


def _load(model: str, name: str, elements: Sequence[Element], timestep: float, integrator: str) -> Rig:
    text = model_path(model).read_text(encoding="utf-8")
    return Rig(
        name,
        text,
        tuple(elements),
        timestep=timestep,
        integrator=integrator,
        folder=str(model_path(model).parent),
    )


def sdof_rig(
    *elements: Element,
    mass: float = 1.0,
    stiffness: float = 0.0,
    damping: float = 0.0,
    timestep: float = 1e-3,
    integrator: str = "RK4",
) -> Rig:
    """The SDOF friction/gap rig: a carriage on linear bearings between a shaker and resisting elements.

    Args:
        *elements: Elements on the joint "carriage"; friction laws may read the actuator "normal_force".
        mass: Mass of the carriage [kg].
        stiffness: Linear spring to ground [N/m].
        damping: Linear damper to ground [N s/m].
        timestep: Integration step [s].
        integrator: As for `Rig`.

    Returns:
        A rig with actuators "shaker" and "normal_force" and sensors load_cell, displacement, velocity, acceleration.

    References:
        Tasbihgoo 2006, section 2.1 and eq. 2.1.
    """
    rig = _load("sdof", "sdof", elements, timestep, integrator)
    return rig.with_structure(
        mass={"carriage": mass}, stiffness={"carriage": stiffness}, damping={"carriage": damping}
    )


def damper_rig(*elements: Element, timestep: float = 1.0 / 1024.0, integrator: str = "RK4") -> Rig:
    """A damper under prescribed motion: element on the joint "piston", moved by a displacement-controlled actuator.

    Drive it with `prescribe(rig, displacement)`.

    References:
        Tasbihgoo 2006, section 3.2.
    """
    return _load("damper", "damper", elements, timestep, integrator)


def true_joint() -> Element:
    """The joint of the dissertation's Nastran deck (appendix B.1), in SI units, named "joint"."""
    return Element.of("axial_torsional_joint", "axial", "torsional", name="joint")


def joint_rig(*elements: Element, timestep: float = 1e-3, integrator: str = "RK4") -> Rig:
    """The 2-DOF axial-torsional joint rig with the deck's numbers; its true joint unless elements are given.

    Returns:
        A rig with actuators "force" and "torque" on body 1, and the joint's coordinates "axial" and "torsional".

    References:
        Tasbihgoo 2006, section 4.2 and appendix B.1.
    """
    return _load("joint", "joint", elements or (true_joint(),), timestep, integrator)


def laboratory_joint_rig(*elements: Element, timestep: float = 1e-3, integrator: str = "RK4") -> Rig:
    """The laboratory-scale joint between a linear and a rotary drive (Tasbihgoo 2006, section 4.3)."""
    return _load("joint_laboratory", "joint_laboratory", elements, timestep, integrator)


def chain_rig(*elements: Element, timestep: float = 1e-3, integrator: str = "RK4") -> Rig:
    """The 8-DOF chain of four bodies; elements go on "axial_23" and "torsional_23" (Tasbihgoo 2006, Figs 5.3, 5.4)."""
    return _load("chain", "chain", elements, timestep, integrator)


def six_dof_rig(*elements: Element, timestep: float = 1e-3, integrator: str = "RK4") -> Rig:
    """Two bodies joined by a general joint with coordinates x, y, z, rx, ry, rz (Tasbihgoo 2006, eqs 5.2-5.15)."""
    return _load("joint_6dof", "joint_6dof", elements, timestep, integrator)


def prescribe(
    rig: Rig, displacement: ArrayLike, *, joint: str = "piston"
) -> Mapping[str, NDArray[np.float64]]:
    """Commands of a displacement-controlled actuator that make `joint` follow a displacement record.

    The commands are taken half a step ahead of each sample, since they are held over the step, and carry the
    inertia force of the moving mass as feed-forward.

    Args:
        rig: A rig with the actuators drive_position, drive_velocity and drive_feedforward.
        displacement: Displacement at the rig's steps [m] (n,), at least eight samples.
        joint: The joint moved.

    Returns:
        Arrays by actuator name, to be used as a drive; start the simulation at `displacement[0]` and its slope
        (`starting`), unless the record starts at rest at zero.

    Raises:
        ModelError: The rig lacks these actuators.
        RecordingError: The displacement is too short or not finite.
        ParameterError: `displacement` is not one-dimensional.
    """
    x = np.asarray(displacement, dtype=float)
    if x.ndim != 1:
        raise ParameterError(f"a displacement record of shape {x.shape} came; one dimension is expected")
    if len(x) < 8 or not np.all(np.isfinite(x)):
        raise RecordingError("a prescribed motion needs at least eight finite samples")
    missing = [name for name in PRESCRIBED_ACTUATORS if name not in rig.actuators]
    if missing:
        raise ModelError(
            f"rig '{rig.name}' cannot follow a prescribed motion: it lacks the actuators {missing}"
        )
    time = np.arange(len(x)) * rig.timestep
    spline = make_interp_spline(time, x, k=5)
    middle = time + 0.5 * rig.timestep
    gear = rig.model.actuator(PRESCRIBED_ACTUATORS[2]).gear[0]
    return {
        "drive_position": spline(middle),
        "drive_velocity": spline(middle, 1),
        "drive_feedforward": inertia_of(rig, joint) / gear * spline(middle, 2),
    }


def starting(rig: Rig, displacement: ArrayLike, *, joint: str = "piston") -> dict[str, tuple[float, float]]:
    """Position and velocity at the first sample of a displacement record, as `initial` of `simulate`."""
    x = np.asarray(displacement, dtype=float)
    spline = make_interp_spline(np.arange(8) * rig.timestep, x[:8], k=5)
    return {joint: (float(x[0]), float(spline(0.0, 1)))}


def inertia_of(rig: Rig, joint: str) -> float:
    """Mass [kg] or inertia [kg m^2] that a joint of the rig moves, at the reference position."""
    identifier = mujoco.mj_name2id(rig.model, mujoco.mjtObj.mjOBJ_JOINT, joint)
    if identifier < 0:
        raise ModelError(f"rig '{rig.name}' has no joint '{joint}'")
    return float(rig.model.dof_M0[rig.model.jnt_dofadr[identifier]])
