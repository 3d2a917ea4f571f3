"""Restoring forces of a joint from records: inertia and mounts subtracted from what is applied to one of its bodies.

For a massless joint between a first and a second body, with relative motion second less first and restoring force r
positive when it opposes that motion,

    ``M₂ a₂ + K₂ x₂ + C₂ v₂ + r = F₂``  and  ``M₁ a₁ + K₁ x₁ + C₁ v₁ - r = F₁``,

so that either body yields r. A joint between a body and the ground is the first case. (Equations 4.2 to 4.9 of the
dissertation print r with the other sign on the first body, which with its own definition of the relative motion would
make the joint drive instead of restore; the deck and the published network follow the convention used here.)

Where the mass is not known, the applied forces less mounts are fitted instead, with the accelerations fed in
(section 4.5): `unknown_mass_data` prepares them for ``fit_polynomial(…, accelerations=…)`` and ``fit_network(…)``.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bench.errors import IdentificationError, ParameterError, UnknownNameError

if TYPE_CHECKING:
    from bench.recording import Recording

Body = Literal["first", "second"]


class JointData(NamedTuple):
    """What a reduced-order joint is fitted to."""

    states: NDArray[np.float64]
    """Relative states (n, 2 k), displacements before velocities [m, rad, m/s, rad/s]."""
    forces: NDArray[np.float64]
    """Restoring forces (n, k), or applied forces less mounts where the mass is unknown [N, N m]."""
    accelerations: NDArray[np.float64] | None = None
    """Accelerations (n, k) of the body where its mass is unknown, with the sign the fits expect [m/s², rad/s²]."""
    time: NDArray[np.float64] | None = None
    """Times (n,) [s], starting anew with every record; models with memory need them."""


def joint_forces(
    applied: ArrayLike,
    acceleration: ArrayLike,
    *,
    mass: ArrayLike,
    displacement: ArrayLike | None = None,
    velocity: ArrayLike | None = None,
    stiffness: ArrayLike = 0.0,
    damping: ArrayLike = 0.0,
    body: Body = "second",
) -> NDArray[np.float64]:
    """Restoring forces of a joint from the forces on one of its bodies and that body's absolute motion.

    Args:
        applied: Forces and torques applied to the body (n, k) [N, N m].
        acceleration: Its absolute acceleration (n, k) [m/s², rad/s²].
        mass: Its masses and inertias: one number, (k,), or a matrix (k, k) [kg, kg m²].
        displacement: Its absolute displacement (n, k) [m, rad]; needed where it has a stiffness to ground.
        velocity: Its absolute velocity (n, k) [m/s, rad/s]; needed where it has a damping to ground.
        stiffness: Its mounts: one number, (k,), or (k, k) [N/m, N m/rad].
        damping: Its mounts: one number, (k,), or (k, k) [N s/m, N m s/rad].
        body: Whether it is the joint's "second" body (or the only one) or its "first".

    Returns:
        ``(n, k)``, positive when they oppose positive relative motion [N, N m].

    Raises:
        IdentificationError: Arrays do not fit or are not finite.
        ParameterError: A mount was given without the motion it acts on, or a coefficient has the wrong shape.

    References:
        Tasbihgoo 2006, eqs. 4.8 and 4.9.
    """
    remaining, a = _less_mounts(applied, acceleration, displacement, velocity, stiffness, damping)
    return _sign(body) * (remaining - a @ _matrix("mass", mass, a.shape[1]).T)


def unknown_mass_data(
    states: ArrayLike,
    applied: ArrayLike,
    acceleration: ArrayLike,
    *,
    displacement: ArrayLike | None = None,
    velocity: ArrayLike | None = None,
    stiffness: ArrayLike = 0.0,
    damping: ArrayLike = 0.0,
    body: Body = "second",
) -> JointData:
    """What a joint is fitted to when the mass of the body is unknown: ``±(F - mounts) = ±M a + r(states)``.

    Args:
        states: Relative states of the joint (n, 2 k) [m, rad, m/s, rad/s].
        applied: As in `joint_forces`.
        acceleration: As in `joint_forces`.
        displacement: As in `joint_forces`.
        velocity: As in `joint_forces`.
        stiffness: As in `joint_forces`.
        damping: As in `joint_forces`.
        body: As in `joint_forces`; the sign is that of the joint's force on it, so that the mass comes out positive.

    Returns:
        States, forces and accelerations for ``fit_polynomial`` or ``fit_network``.

    Raises:
        IdentificationError: As in `joint_forces`.
        ParameterError: As in `joint_forces`.

    References:
        Tasbihgoo 2006, section 4.5.
    """
    remaining, a = _less_mounts(applied, acceleration, displacement, velocity, stiffness, damping)
    sign = _sign(body)
    return JointData(np.array(states, dtype=float), sign * remaining, sign * a)


def joint_data(
    recordings: Recording | Sequence[Recording],
    *,
    displacements: Sequence[str],
    velocities: Sequence[str],
    applied: Sequence[str],
    accelerations: Sequence[str],
    mass: ArrayLike | None,
    body_displacements: Sequence[str] = (),
    body_velocities: Sequence[str] = (),
    stiffness: ArrayLike = 0.0,
    damping: ArrayLike = 0.0,
    body: Body = "second",
) -> JointData:
    """States and restoring forces of a joint from the channels of one or several recordings.

    Args:
        recordings: One recording or several, taken one after the other; samples before `settle` are left out.
        displacements: Channels of the relative displacements, one a joint coordinate.
        velocities: Channels of the relative velocities.
        applied: Channels of the forces applied to the body.
        accelerations: Channels of the body's absolute accelerations.
        mass: As in `joint_forces`; None where it is unknown and is to be fitted.
        body_displacements: Channels of the body's absolute displacements.
        body_velocities: Channels of the body's absolute velocities.
        stiffness: As in `joint_forces`.
        damping: As in `joint_forces`.
        body: As in `joint_forces`.

    Returns:
        States and restoring forces; with `mass` None states, applied forces less mounts, and accelerations.

    Raises:
        UnknownNameError: A recording has no such channel.
        IdentificationError: As in `joint_forces`.
        ParameterError: As in `joint_forces`.
    """
    records = recordings if isinstance(recordings, Sequence) else (recordings,)

    def read(names: Sequence[str]) -> NDArray[np.float64]:
        columns = [np.stack([record[name] for name in names], axis=1)[_settled(record)] for record in records]
        return np.concatenate(columns)

    states = np.hstack([read(displacements), read(velocities)])
    mounts = {
        "displacement": read(body_displacements) if body_displacements else None,
        "velocity": read(body_velocities) if body_velocities else None,
        "stiffness": stiffness,
        "damping": damping,
    }
    force, acceleration = read(applied), read(accelerations)
    clock = np.concatenate([record.time[_settled(record)] - record.time[0] for record in records])
    if mass is None:
        return unknown_mass_data(states, force, acceleration, body=body, **mounts)._replace(time=clock)
    return JointData(states, joint_forces(force, acceleration, mass=mass, body=body, **mounts), time=clock)


def _settled(recording: Recording) -> NDArray[np.bool_]:
    return recording.time - recording.time[0] >= recording.settle


def _sign(body: str) -> float:
    if body not in ("first", "second"):
        raise UnknownNameError("body of a joint", body, ("first", "second"))
    return 1.0 if body == "second" else -1.0


def _columns(name: str, values: ArrayLike) -> NDArray[np.float64]:
    array = np.array(values, dtype=float)
    array = array[:, None] if array.ndim == 1 else array
    if array.ndim != 2:
        raise IdentificationError(f"{name} has shape {array.shape}; (n, k) or (n,) is expected")
    if not np.all(np.isfinite(array)):
        row = int(np.argwhere(~np.isfinite(array))[0, 0])
        raise IdentificationError(
            f"{name} is not finite at sample {row}; cut the gap out of the record first"
        )
    return array


def _matrix(name: str, values: ArrayLike, size: int) -> NDArray[np.float64]:
    array = np.asarray(values, dtype=float)
    if array.ndim == 2 and array.shape == (size, size):
        return array
    if array.ndim == 0 or array.shape == (size,):
        return np.diag(np.broadcast_to(array, (size,)))
    raise ParameterError(
        f"{name} has shape {array.shape}; one number, ({size},) or ({size}, {size}) is expected"
    )


def _less_mounts(
    applied: ArrayLike,
    acceleration: ArrayLike,
    displacement: ArrayLike | None,
    velocity: ArrayLike | None,
    stiffness: ArrayLike,
    damping: ArrayLike,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Applied forces less those of the mounts, and the accelerations, both (n, k)."""
    remaining, a = _columns("applied", applied), _columns("acceleration", acceleration)
    motions = (
        ("stiffness", stiffness, "displacement", displacement),
        ("damping", damping, "velocity", velocity),
    )
    if a.shape != remaining.shape:
        raise IdentificationError(
            f"acceleration has shape {a.shape}; that of the applied forces, {remaining.shape}, is expected"
        )
    for coefficient, value, name, motion in motions:
        matrix = _matrix(coefficient, value, remaining.shape[1])
        if not np.any(matrix):
            continue
        if motion is None:
            raise ParameterError(f"a {coefficient} of the mounts was given without the body's {name}")
        columns = _columns(name, motion)
        if columns.shape != remaining.shape:
            raise IdentificationError(
                f"{name} has shape {columns.shape}; that of the applied forces, {remaining.shape}, is expected"
            )
        remaining = remaining - columns @ matrix.T
    return remaining, a
