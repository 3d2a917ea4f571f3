"""The user's own MJCF as the structure of a diagnosis.

The matrices are read off the compiled model by `LinearRig`, which refuses whatever is not linear: the diagnosis adds forces to
a linear structure, and an approximation in the nominal model would come back as an effect. Four things that are not linear are
dealt with here, since hardly a model is without them. Dry friction (``frictionloss``) stays friction of the nominal model,
which creeps at rest as MuJoCo lets it (`model.mjcf_friction`). Ranges of joints and controls, and contacts, are left out as long as
the measured motion and the loads never reach them; where they do, the record is refused. Gravity on a slide only shifts the
rest position, from which motion is counted; on a pendulum it is a spring that bends with the angle, which is known and is added
(`mjcf_gravity`).

Entries of ``nominal.json`` refer to the model by name:

| entry | names |
|---|---|
| parameter | ``mass:BODY``, ``inertia:BODY``, ``stiffness:JOINT`` and likewise ``damping``, ``armature``, ``frictionloss`` |
| response | a sensor by the channel's own name or ``"sensor"``; ``"joint"`` with ``"quantity"``: position, velocity, acceleration |
| load | an actuator, or an ``actuatorfrc`` sensor, by the channel's own name, ``"actuator"`` or ``"sensor"`` |
| ``"places"`` | joints and fixed tendons where effects may sit; all that move where it is absent |
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import NDArray

from bench import native
from bench.discrepancy.case.case import NO_LOAD, Case, CaseChannel
from bench.discrepancy.case.elements import declared_parameters
from bench.discrepancy.model.mjcf_couplings import LINK, constrained, rows_of, stiff_modes, without_equalities
from bench.discrepancy.model.mjcf_file import rig_of
from bench.discrepancy.model.mjcf_friction import nominal_frictions
from bench.discrepancy.model.mjcf_gravity import gravity_springs, has_gravity, without_gravity
from bench.discrepancy.model.mjcf_limits import check_reach, free_of_constraints
from bench.discrepancy.model.nominal_forces import NominalFriction, NominalSpring
from bench.discrepancy.model.structure import Place, Structure
from bench.discrepancy.motion.observer import Observer
from bench.discrepancy.settings import DiagnosisSettings, ModelSettings, SimulationSettings
from bench.errors import BenchError, FileFormatError, ModelError, UnknownNameError
from bench.identification.linear_rig import LinearRig, current
from bench.native.encoding import Coordinate
from bench.rig import Rig
from bench.rig.building import STRUCTURE

Array = NDArray[np.float64]
QUANTITIES = ("position", "velocity", "acceleration")
PROBE = "position of "
"""Beginning of the names of sensors added for channels that refer to joints."""


def mjcf_structure(case: Case, *, settings: DiagnosisSettings) -> Structure:
    """Build the structure of a case whose rig is an MJCF file, relative to the folder of the case.

    Raises:
        ModelError: The model cannot be read, is not linear, or its stops, contacts or control ranges come into play.
        UnknownNameError: A parameter, channel or place names nothing in the model.
        FileFormatError: An entry is not of the form expected.
    """
    path = Path(case.folder or ".") / case.rig
    own = rig_of(case)
    rig, links = plain_rig(case, own)
    declared = declared_parameters(case.options.get("elements", []), case.name)
    believed = {p.name: p.value for p in case.parameters if p.name not in declared}
    names = tuple(believed)
    structural = [_structural(name, rig) for name in names]
    loads, responses = loads_and_responses(case, rig, settings=settings.model)
    parameters = [name for name in structural if not name.startswith("structure/frictionloss/")]
    try:
        linear, bent = _linear(rig, [sensor for _, sensor, _ in responses] + _cells(loads), parameters)
    except ModelError as error:
        raise ModelError(
            f"'{path}' cannot be the nominal model of a diagnosis: {error}. The nominal model has to be linear in position, "
            "velocity and command: take out what bends it (levers that carry one another, stops, "
            "couplings) or replace it by its tangent, a stiffness at the joint; the diagnosis looks for what is missing"
        ) from None
    n_dof = len(linear.dofs)
    inputs = _inputs(loads, rig, linear, len(responses))
    observers = tuple(
        _observer(channel, row, order, n_dof, rig, settings=settings.model)
        for (channel, _, order), row in zip(responses, linear.observation, strict=False)
    )
    stacks, fixed = _stacks(structural, linear, rig, settings=settings.model)
    # before gravity makes a stiffness of a mass: what is called the stiffness of a place is a spring of the model
    places = _places(case, rig, linear, names, stacks, settings=settings.model)
    springs: tuple[NominalSpring, ...] = ()
    if bent:
        springs, tangents, changes = gravity_springs(rig, linear, structural, settings=settings.model)
        fixed[2] += np.diag(tangents)
        stacks[2][:] += np.array([np.diag(change) for change in changes])
    structure = Structure(
        tuple(rig.model.joint(int(rig.model.dof_jntid[dof])).name for dof in linear.dofs),
        names, *stacks, inputs, tuple(channel.name for channel, _ in loads), observers,
        places, fixed, _frictions(own, linear, names, case.identification[0].step, settings=settings.simulation), springs,
    )  # fmt: skip
    driving = {channel.name: actuator for channel, actuator in loads if actuator}
    check_reach(case, structure, own, driving, linear.dofs, settings=settings)
    structure = constrained(
        structure, rows_of(own.model, links, structure.dofs), [next(iter(link)) for link in links]
    )
    values = np.array(list(believed.values()))
    return constrained(
        structure,
        stiff_modes(structure, values, min(r.step for r in case.identification), settings=settings.model),
    )


def plain_rig(case: Case, own: Rig) -> tuple[Rig, list[dict[str, float]]]:
    """The user's model without what is no matrix, with sensors for channels that refer to joints; and its linear equalities."""
    joints = sorted({c.target.removeprefix("joint:") for c in case.channels if c.target.startswith("joint:")})
    coupled, links = without_equalities(own)
    return free_of_constraints(coupled, joints, prefix=PROBE), links


def _linear(rig: Rig, channels: Sequence[str], parameters: Sequence[str]) -> tuple[LinearRig, bool]:
    """The matrices of a model, and whether they are those without gravity, since it bends the model."""
    try:
        return LinearRig.of(rig, channels, parameters), False
    except ModelError:
        if not has_gravity(rig):
            raise
        try:
            return LinearRig.of(without_gravity(rig), channels, parameters), True
        except ModelError:
            pass
        raise


def _structural(name: str, rig: Rig) -> str:
    """A parameter's name in `LinearRig`."""
    kind, colon, target = name.partition(":")
    if not colon or kind not in STRUCTURE:
        raise UnknownNameError(
            f"parameter of the model '{rig.name}'", name, [f"{entry}:NAME" for entry in STRUCTURE]
        )
    if kind == "frictionloss":
        _coordinate(rig.model, target)
    return f"structure/{kind}/{target}"


def loads_and_responses(
    case: Case, rig: Rig, *, settings: ModelSettings
) -> tuple[list[tuple[CaseChannel, str]], list[tuple[CaseChannel, str, int | None]]]:
    """Loads with their actuator or its force sensor; responses with their sensor, and the order where a joint is meant."""
    columns = [c.name for c in rig.channels[len(rig.actuators) :]]
    force_sensors = _force_sensors(rig.model)
    loads, responses = [], []
    for channel in case.channels:
        if channel.role == "scheduling":
            continue
        if channel.name == NO_LOAD:
            loads.append((channel, ""))
            continue
        kind, _, name = channel.target.rpartition(":")
        name = name or channel.name
        if channel.role == "prescribed":
            raise FileFormatError(
                f"channel '{channel.name}' is prescribed; a model of your own is driven by its actuators: use the rig "
                "'damper' for a component under prescribed motion"
            )
        load = channel.role != "response" or kind == "actuator" or name in force_sensors
        if kind == "joint":
            responses.append((channel, PROBE + name, _order(channel)))
        elif load or (not kind and name in rig.actuators and name not in columns):
            known = (*rig.actuators, *force_sensors)
            if name not in known:
                raise UnknownNameError(f"actuator (or actuatorfrc sensor) of '{rig.name}'", name, known)
            loads.append((channel, force_sensors.get(name, name)))
        else:
            axes = [
                c for c in columns if c == name or (c[: -len("_x")] == name and c[-2:] in {"_x", "_y", "_z"})
            ]
            if not axes:
                raise UnknownNameError(f"sensor of '{rig.name}'", name, [*columns, *rig.actuators])
            responses.append((channel, _axis(rig, channel, axes, settings=settings), None))
    if not loads:
        raise FileFormatError(
            f"case '{case.name}' has no load; name a channel after an actuator of the model ({', '.join(rig.actuators) or 'none'}) "
            'or give it an entry "actuator"; for a free decay say that it "starts_in_motion"'
        )
    if not responses:
        raise FileFormatError(
            f"case '{case.name}' has no response; name a channel after a sensor of the model ({', '.join(columns) or 'none'}) "
            'or give it "joint" and "quantity"'
        )
    return loads, responses


def _force_sensors(model: mujoco.MjModel) -> dict[str, str]:
    """Sensors that read the force of an actuator, by name."""
    kind = int(mujoco.mjtSensor.mjSENS_ACTUATORFRC)
    return {
        model.sensor(i).name: model.actuator(int(model.sensor_objid[i])).name
        for i in range(model.nsensor)
        if int(model.sensor_type[i]) == kind
    }


def _cells(loads: Sequence[tuple[CaseChannel, str]]) -> list[str]:
    """Force sensors whose reading is the load itself rather than the command behind it."""
    return [name for name in dict.fromkeys(_sensor_of(channel) for channel, _ in loads) if name]


def _sensor_of(channel: CaseChannel) -> str:
    return channel.target.removeprefix("sensor:") if channel.target.startswith("sensor:") else ""


def _order(channel: CaseChannel) -> int:
    if channel.quantity not in QUANTITIES:
        raise UnknownNameError(f"quantity of channel '{channel.name}'", channel.quantity, QUANTITIES)
    return QUANTITIES.index(channel.quantity)


def _axis(rig: Rig, channel: CaseChannel, axes: list[str], *, settings: ModelSettings) -> str:
    """The one component of a sensor that the motion reaches."""
    if len(axes) == 1:
        return axes[0]
    moving = []
    for axis in axes:
        linear = LinearRig.of(rig, [axis])
        if len(linear.dofs) and np.any(
            np.abs(linear.observation[:, : 3 * len(linear.dofs)]) > settings.negligible
        ):
            moving.append(axis)
    if len(moving) != 1:
        raise FileFormatError(
            f"channel '{channel.name}' may be any of {', '.join(moving or axes)}; name the component: "
            f'"sensor": "{(moving or axes)[0]}"'
        )
    return moving[0]


def _inputs(loads: Sequence[tuple[CaseChannel, str]], rig: Rig, linear: LinearRig, n_responses: int) -> Array:
    """How the loads act (n_dof, n_loads), in the units of their channels."""
    matrix = linear.matrices[3]
    cells = _cells(loads)
    out = np.zeros((len(linear.dofs), len(loads)))
    for j, (channel, actuator) in enumerate(loads):
        if not actuator:
            out[:, j] = 1.0
            continue
        u = rig.actuators.index(actuator)
        out[:, j] = matrix[:, u]
        if cell := _sensor_of(channel):
            reading = linear.observation[n_responses + cells.index(cell), 3 * len(linear.dofs) + u]
            out[:, j] /= reading
        if not np.any(out[:, j]):
            raise ModelError(
                f"the load '{channel.name}' (actuator '{actuator}') moves nothing that a channel measures"
            )
    return out


def _observer(
    channel: CaseChannel, row: Array, order: int | None, n_dof: int, rig: Rig, *, settings: ModelSettings
) -> Observer:
    """A response as a row of the motion, in the unit of its channel."""
    blocks = row[: 3 * n_dof].reshape(3, n_dof)
    if order is not None:
        return Observer(channel.name, order, blocks[0])
    largest = np.abs(blocks).max(axis=1)
    present = np.flatnonzero(largest > settings.negligible * max(float(largest.max()), 1e-300))
    if len(present) != 1:
        what = " and ".join(QUANTITIES[i] for i in present) or "nothing of the motion"
        raise ModelError(
            f"channel '{channel.name}' of '{rig.name}' reads {what}; one of position, velocity, acceleration is expected"
        )
    scaled = blocks[present[0]].copy()
    scaled[np.abs(scaled) <= settings.negligible * largest.max()] = 0.0
    return Observer(channel.name, int(present[0]), scaled)


def _stacks(
    structural: Sequence[str], linear: LinearRig, rig: Rig, *, settings: ModelSettings
) -> tuple[tuple[Array, Array, Array], Array]:
    """Contributions of the parameters to mass, damping and stiffness, and what no parameter changes."""
    n_dof = len(linear.dofs)
    stacks = tuple(np.zeros((len(structural), n_dof, n_dof)) for _ in range(3))
    fixed = np.array([matrix.copy() for matrix in linear.matrices[:3]])
    for i, name in enumerate(structural):
        if name not in linear.parameters:
            continue
        at = current(rig, name)
        for k, change in enumerate(linear.slope(name)):
            stacks[k][i] = change
            fixed[k] -= at * change
    for k, matrix in enumerate(linear.matrices[:3]):
        fixed[k][np.abs(fixed[k]) <= settings.negligible * max(float(np.abs(matrix).max()), 1e-300)] = 0.0
    return (stacks[0], stacks[1], stacks[2]), fixed


def _coordinate(model: mujoco.MjModel, name: str) -> Coordinate:
    return native.coordinate(model, name)


def _row(model: mujoco.MjModel, name: str, dofs: NDArray[np.int64]) -> Array:
    """A joint or fixed tendon as a row over the kept degrees of freedom; zeros where it moves others, too."""
    row = np.zeros(model.nv)
    for _, dof, coefficient in _coordinate(model, name).terms:
        row[dof] += coefficient
    return row[dofs] if np.count_nonzero(row) == np.count_nonzero(row[dofs]) else np.zeros(len(dofs))


def _frictions(
    own: Rig, linear: LinearRig, names: Sequence[str], step: float, *, settings: SimulationSettings
) -> tuple[NominalFriction, ...]:
    """Dry friction of the model itself."""
    model = own.model
    joints = [model.joint(int(model.dof_jntid[dof])).name for dof in linear.dofs]
    tendons = [model.tendon(i).name for i in range(model.ntendon)]
    frictional = [
        name
        for name in tendons
        if f"frictionloss:{name}" in names or model.tendon_frictionloss[model.tendon(name).id] > 0.0
    ]
    rows = [(name, _row(model, name, linear.dofs)) for name in (*joints, *frictional)]
    return nominal_frictions(model, rows, names, step, settings=settings)


def _places(
    case: Case,
    rig: Rig,
    linear: LinearRig,
    names: Sequence[str],
    stacks: tuple[Array, Array, Array],
    *,
    settings: ModelSettings,
) -> tuple[Place, ...]:
    model = rig.model
    joints = [model.joint(int(model.dof_jntid[dof])).name for dof in linear.dofs]
    tendons = [name for i in range(model.ntendon) if not (name := model.tendon(i).name).startswith(LINK)]
    known = [name for name in (*joints, *tendons) if name and (name in joints or _is_fixed(model, name))]
    wanted = case.options.get("places", known)
    if not isinstance(wanted, (list, tuple)) or not wanted:
        raise FileFormatError(
            f"places is {wanted!r}; a list of joints and fixed tendons is expected: {', '.join(known)}"
        )
    out = []
    for name in wanted:
        if name not in known:
            raise UnknownNameError(
                f"place (joint or fixed tendon that moves) of '{rig.name}'", str(name), known
            )
        row = _row(model, name, linear.dofs)
        if not np.any(row):
            continue
        hinge = _hinges(model, name)
        own = [_carries(stack, row, k == 0, settings=settings) for k, stack in enumerate(stacks)]
        out.append(
            Place(
                "" if len(wanted) == 1 else name, row[None, :], "rad" if hinge else "m", "N m" if hinge else "N",
                tuple(names[i] for i in own[0]),
                next((names[i] for i in own[2]), ""), next((names[i] for i in own[1]), ""), name,
            )
        )  # fmt: skip
    return tuple(out)


def _is_fixed(model: mujoco.MjModel, name: str) -> bool:
    try:
        _coordinate(model, name)
    except BenchError:
        return False
    return True


def _hinges(model: mujoco.MjModel, name: str) -> bool:
    _, dof, _ = _coordinate(model, name).terms[0]
    return int(model.jnt_type[model.dof_jntid[dof]]) == int(mujoco.mjtJoint.mjJNT_HINGE)


def _carries(stack: Array, row: Array, any_motion: bool, *, settings: ModelSettings) -> list[int]:
    """Parameters that act on a coordinate: inertias that it moves, or springs and dampers of just this coordinate."""
    out = []
    for i, matrix in enumerate(stack):
        largest = float(np.abs(matrix).max())
        if largest == 0.0:
            continue
        if any_motion:
            acts = float(row @ matrix @ row) > settings.negligible * largest
        else:
            outer = np.outer(row, row)
            acts = bool(np.allclose(matrix, outer * largest / np.abs(outer).max(), atol=1e-9 * largest))
        if acts:
            out.append(i)
    return out
