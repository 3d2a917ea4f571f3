"""A reduced-order joint with six relative coordinates: identified in one structure, swapped in, tried on an unseen drive.

The dissertation writes its method for joints with up to six degrees of freedom (eqs. 5.2 to 5.15) and shows two. Here all
six act at once: `six_dof_joint` puts springs, dampers, a gap, cubic stiffness and couplings between directions under
a payload on a shaking table; `six_dof_study` shakes the table in all six directions, recovers the joint's restoring
forces as a laboratory would, from motions and known inertia, identifies a model with twelve inputs and six outputs,
and puts it in the place of the true joint.

A full tensor of order 3 in twelve states has 16.8 million terms; a polynomial of total degree 3 has 455, and a network
with 30 units 576 weights.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Literal, NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import make_interp_spline

from bench import native
from bench.errors import ParameterError, UnknownNameError
from bench.identification.network import fit_network
from bench.identification.polynomial import fit_polynomial
from bench.identification.restoring_force import JointData
from bench.laws.along import force_along
from bench.recording import Recording, nmse
from bench.rig import Element, Rig, simulate, simulate_batch
from bench.rig.library import six_dof_rig
from bench.signals import BandLimitedNoise, Excitation

COORDINATES = ("x", "y", "z", "rx", "ry", "rz")
"""The joint's coordinates, body 2 less body 1: displacements [m], then rotations [rad]."""


class SixDofStudy(NamedTuple):
    """A six-coordinate joint identified and swapped."""

    true: Rig
    reduced: Rig
    training: tuple[Recording, ...]
    """Records of the true rig that the joint was identified from."""
    data: JointData
    """States and restoring forces recovered from them."""
    recovery: dict[str, float]
    """NMSE [%] of the recovered restoring forces against the true ones, by coordinate."""
    fit: dict[str, float]
    """NMSE [%] of the identified forces on the training data, by coordinate."""
    unseen_true: Recording
    unseen_reduced: Recording
    displacement: dict[str, float]
    """NMSE [%] of the relative displacement under the unseen drive, in closed loop, by coordinate."""
    force: dict[str, float]
    """NMSE [%] of the restoring force under the unseen drive, in closed loop, by coordinate."""


def six_dof_joint() -> tuple[Element, ...]:
    """A joint with six coordinates, made of laws of the catalogue: about 10 to 20 Hz under the rig's 10 kg payload.

    Beside a spring and a damper in each direction: a gap spring in x, hardening in z and ry, a helix-like coupling of z and rz,
    and a damping in y and rz that sets in when the other has moved far, the coupling of the dissertation's deck.
    """
    springs = {
        "x": (6.0e4, 60.0),
        "y": (7.0e4, 70.0),
        "z": (1.0e5, 80.0),
        "rx": (2.0e3, 3.0),
        "ry": (2.2e3, 3.0),
        "rz": (6.0e2, 0.6),
    }
    linear = [Element.of("linear", joint, stiffness=k, damping=c) for joint, (k, c) in springs.items()]
    return (
        *linear,
        Element.of("gap", "x", stiffness=6.0e4, clearance=1.0e-3),
        Element.of("cubic_stiffness", "z", k3=2.0e10),
        Element.of("cubic_stiffness", "ry", k3=4.0e6),
        Element.of("cross_stiffness", "z", "rz", stiffness=2.0e3),
        Element.of(
            "gap_coupling",
            "y",
            "rz",
            c_axial=3.0e4,
            c_torsional=4.0e2,
            clearance_torsional=2.0e-3,
            clearance_axial=5.0e-4,
        ),
    )


def six_dof_excitation(*, duration: float = 20.0, level: float = 1.0, cutoff: float = 25.0) -> Excitation:
    """Uncorrelated band-limited noise on the table's three forces and three torques.

    Args:
        duration: Length [s].
        level: Factor on the peaks, 600 N and 40 N m.
        cutoff: Highest frequency [Hz].
    """
    peaks = {f"force_{axis}": 600.0 * level for axis in "xyz"} | {
        f"torque_{axis}": 40.0 * level for axis in "xyz"
    }
    signals = {name: BandLimitedNoise(cutoff=cutoff, peak=peak) for name, peak in peaks.items()}
    return Excitation(signals, duration=duration, sample_rate=1000.0)


def coordinate_forces(rig: Rig, recording: Recording) -> NDArray[np.float64]:
    """Restoring forces of a rig's elements on the six coordinates, summed from their channels.

    Args:
        rig: The rig the record is of.
        recording: Its record, (n,) samples.

    Returns:
        ``(n, 6)`` [N], [N m].
    """
    total = np.zeros((len(recording.time), len(COORDINATES)))
    for element in rig.elements:
        for i, joint in enumerate(element.joints):
            suffix = "" if len(element.joints) == 1 else f"_{i + 1}"
            total[:, COORDINATES.index(joint)] += recording[f"{element.name}/force{suffix}"]
    return total


def recovered_forces(rig: Rig, recording: Recording) -> JointData:
    """Restoring forces of the joint from the recorded motion and the known inertia, by inverse dynamics.

    Accelerations are derivatives of the measured velocities (quintic spline). The drive's steps make them jump from sample
    to sample, alike on both bodies; what the payload feels, the sum, is smooth.

    Args:
        rig: The rig; only its bodies are used.
        recording: A record with every joint's position and velocity.

    Returns:
        States ``(n, 12)``, displacements before velocities, and forces ``(n, 6)``, positive when they oppose positive
        displacement.

    References:
        Tasbihgoo 2006, eqs. 4.8 and 4.9, for a joint whose coordinates turn with the body.
    """
    bare = rig.with_(elements=())
    model, data = bare.model, mujoco.MjData(bare.model)
    joints = [model.joint(i).name for i in range(model.njnt)]
    position = np.stack([recording[name] for name in joints], axis=1)
    velocity = np.stack([recording[f"{name}_velocity"] for name in joints], axis=1)
    acceleration = make_interp_spline(recording.time, velocity, k=5).derivative()(recording.time)
    forces = np.empty((len(position), len(COORDINATES)))
    at = [int(model.joint(name).dofadr[0]) for name in COORDINATES]
    with native.running(model):
        for i in range(len(position)):
            data.qpos[:], data.qvel[:], data.qacc[:] = position[i], velocity[i], acceleration[i]
            mujoco.mj_inverse(model, data)
            forces[i] = -data.qfrc_inverse[at]
    columns = [joints.index(name) for name in COORDINATES]
    return JointData(np.concatenate([position[:, columns], velocity[:, columns]], axis=1), forces)


def six_dof_study(
    *,
    kind: Literal["polynomial", "network"] = "polynomial",
    settings: Mapping[str, object] | None = None,
    joint: tuple[Element, ...] | None = None,
    n_records: int = 3,
    duration: float = 20.0,
    unseen_duration: float = 10.0,
    unseen_level: float = 0.8,
    stride: int = 4,
    settle: float = 1.0,
    seed: int = 6,
) -> SixDofStudy:
    """Identify a reduced-order joint with six coordinates and compare it with the true one in closed loop.

    Args:
        kind: "polynomial" of total degree, or "network".
        settings: Settings of `fit_polynomial` (total degree 3 unless given) or of `fit_network`.
        joint: Elements of the true joint on the coordinates; `six_dof_joint` by default.
        n_records: Number of training records, each of its own random drive.
        duration: Length of each [s].
        unseen_duration: Length of the unseen record [s].
        unseen_level: Its level against the training's; above 1 the model is used outside its range.
        stride: Every stride-th sample of a record is used for identification.
        settle: Seconds left out at the start of each record.
        seed: Seed of the drives and of the network's starts.

    Raises:
        UnknownNameError: `kind` is neither.
        ParameterError: No training records.
        IdentificationError: The data do not determine the model.
        SimulationError: The rig with the identified joint diverged.
    """
    if n_records < 1 or stride < 1:
        raise ParameterError(
            f"{n_records} records with every {stride}th sample were asked for; at least 1 of each is expected"
        )
    true = six_dof_rig(*(six_dof_joint() if joint is None else joint))
    generators = [np.random.default_rng([seed, i]) for i in range(n_records + 2)]
    training = simulate_batch(
        [true] * n_records,
        [six_dof_excitation(duration=duration)],
        rngs=generators[:n_records],
        settle=settle,
    )
    data, recovery = _recovered(true, training, stride)
    element = _identify(data, kind, dict(settings or {}), generators[-1])
    reduced = true.with_(elements=(element,))
    drive = six_dof_excitation(duration=unseen_duration, level=unseen_level)
    commands = dict(zip(drive.names, drive.sample(generators[-2]).T, strict=True))
    unseen = [simulate(rig, commands, settle=settle) for rig in (true, reduced)]
    rows = unseen[0].scored
    return SixDofStudy(
        true=true,
        reduced=reduced,
        training=tuple(training),
        data=data,
        recovery=recovery,
        fit=_scores(data.forces, _forces_at(element, data.states)),
        unseen_true=unseen[0],
        unseen_reduced=unseen[1],
        displacement={name: nmse(unseen[0][name][rows], unseen[1][name][rows]) for name in COORDINATES},
        force=_scores(coordinate_forces(true, unseen[0])[rows], coordinate_forces(reduced, unseen[1])[rows]),
    )


def _recovered(true: Rig, training: Sequence[Recording], stride: int) -> tuple[JointData, dict[str, float]]:
    """Every stride-th sample recovered from the records, and the NMSE of all recovered forces against the true ones [%]."""
    scored = [record.scored for record in training]
    recovered = [recovered_forces(true, record) for record in training]
    states = [data.states[rows] for data, rows in zip(recovered, scored, strict=True)]
    forces = [data.forces[rows] for data, rows in zip(recovered, scored, strict=True)]
    exact = [coordinate_forces(true, record)[rows] for record, rows in zip(training, scored, strict=True)]
    data = JointData(
        np.concatenate([part[::stride] for part in states]),
        np.concatenate([part[::stride] for part in forces]),
    )
    return data, _scores(np.concatenate(exact), np.concatenate(forces))


def _forces_at(element: Element, states: NDArray[np.float64]) -> NDArray[np.float64]:
    """Forces of an identified joint ``(n, 6)`` at states ``(n, 12)``."""
    return force_along(element.law, element.theta, np.zeros(len(states)), *np.hsplit(states, 2))


def _identify(data: JointData, kind: str, settings: dict[str, Any], rng: np.random.Generator) -> Element:
    if kind == "polynomial":
        total: dict[str, Any] = {"orders": 3, "kind": "total", "degree": 3}
        model = fit_polynomial(data.states, data.forces, **total | settings)
    elif kind == "network":
        model = fit_network(data.states, data.forces, rng=rng, **settings)
    else:
        raise UnknownNameError("kind of reduced-order model", kind, ("polynomial", "network"))
    return Element(model.law, COORDINATES, model.theta, name="joint", validity=model.range)


def _scores(measured: NDArray[np.float64], simulated: NDArray[np.float64]) -> dict[str, float]:
    return {name: nmse(measured[:, i], simulated[:, i]) for i, name in enumerate(COORDINATES)}
