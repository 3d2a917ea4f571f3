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
| prescribed motion | the role ``"prescribed"`` at a channel that a sensor or a joint is named for (`mjcf_prescribed`) |
| ``"places"`` | joints and fixed tendons where effects may sit; all that move where it is absent |
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import mujoco
import numpy as np

from bench import native
from bench.arrays import Array
from bench.discrepancy.case.case import Case, CaseChannel
from bench.discrepancy.case.elements import declared_parameters
from bench.discrepancy.model.mjcf_channels import PROBE, cells, inputs_of, loads_and_responses, observer_of
from bench.discrepancy.model.mjcf_couplings import constrained, rows_of, stiff_modes, without_equalities
from bench.discrepancy.model.mjcf_file import rig_of
from bench.discrepancy.model.mjcf_gravity import gravity_springs, has_gravity, without_gravity
from bench.discrepancy.model.mjcf_limits import check_reach, free_of_constraints
from bench.discrepancy.model.mjcf_places import frictions_of, places_of
from bench.discrepancy.model.mjcf_prescribed import with_large_masses
from bench.discrepancy.model.nominal_forces import NominalSpring
from bench.discrepancy.model.structure import Structure
from bench.discrepancy.settings import DiagnosisSettings, ModelSettings
from bench.errors import ModelError, UnknownNameError
from bench.identification.linear_rig import LinearRig, current
from bench.rig import Rig
from bench.rig.structure import STRUCTURE


def mjcf_structure(case: Case, *, settings: DiagnosisSettings) -> Structure:
    """Build the structure of a case whose rig is an MJCF file, relative to the folder of the case.

    Raises:
        ModelError: The model cannot be read, is not linear, or its stops, contacts or control ranges come into play.
        UnknownNameError: A parameter, channel or place names nothing in the model.
        FileFormatError: An entry is not of the form expected.
    """
    own = rig_of(case)
    rig, links = plain_rig(case, own)
    loads, responses = loads_and_responses(case, rig, settings=settings.model)
    declared = declared_parameters(case.options.get("elements", []), case.name)
    believed = {p.name: p.value for p in case.parameters if p.name not in declared}
    structure, linear = _without_couplings(case, (own, rig), tuple(believed), loads, responses, settings)
    driving = {channel.name: actuator for channel, actuator in loads if actuator}
    check_reach(case, structure, own, driving, linear.dofs, settings=settings)
    structure = with_large_masses(case, rig, structure, settings=settings.model)
    structure = constrained(
        structure, rows_of(own.model, links, structure.dofs), [next(iter(link)) for link in links]
    )
    values = np.array(list(believed.values()))
    return constrained(
        structure,
        stiff_modes(structure, values, min(r.step for r in case.identification), settings=settings.model),
    )


def _refuse_loose(case: Case, model: mujoco.MjModel) -> None:
    """Refuse joints that are neither slides nor hinges, by name."""
    kinds = (int(mujoco.mjtJoint.mjJNT_SLIDE), int(mujoco.mjtJoint.mjJNT_HINGE))
    loose = [
        model.joint(i).name or f"number {i}" for i in range(model.njnt) if int(model.jnt_type[i]) not in kinds
    ]
    if loose:
        raise ModelError(
            f"'{case.rig}' has the free or ball joint '{loose[0]}'; a diagnosis takes slides and hinges on a fixed or prescribed base: "
            "hang the robot up, lock the joint, or cut out the limb that was tested"
        )


def _without_couplings(
    case: Case,
    rigs: tuple[Rig, Rig],
    names: tuple[str, ...],
    loads: Sequence[tuple[CaseChannel, str]],
    responses: Sequence[tuple[CaseChannel, str, int | None]],
    settings: DiagnosisSettings,
) -> tuple[Structure, LinearRig]:
    """The structure on all joints that channels depend on, and its matrices; `rigs` are the user's own and the plain one."""
    own, rig = rigs
    _refuse_loose(case, rig.model)
    structural = [_structural(name, rig) for name in names]
    parameters = [name for name in structural if not name.startswith("structure/frictionloss/")]
    try:
        linear, bent = _linear(rig, [sensor for _, sensor, _ in responses] + cells(loads), parameters)
    except ModelError as error:
        raise ModelError(
            f"'{Path(case.folder or '.') / case.rig}' cannot be the nominal model of a diagnosis: {error}. The nominal model has to be "
            "linear in position, velocity and command: take out what bends it (levers that carry one another, stops, "
            "couplings) or replace it by its tangent, a stiffness at the joint; the diagnosis looks for what is missing"
        ) from None
    n_dof = len(linear.dofs)
    inputs = inputs_of(loads, rig, linear, len(responses))
    observers = tuple(
        observer_of(channel, row, order, n_dof, rig, settings=settings.model)
        for (channel, _, order), row in zip(responses, linear.observation, strict=False)
    )
    stacks, fixed = _stacks(structural, linear, rig, settings=settings.model)
    # before gravity makes a stiffness of a mass: what is called the stiffness of a place is a spring of the model
    places = places_of(case, rig, linear, names, stacks, settings=settings.model)
    springs: tuple[NominalSpring, ...] = ()
    if bent:
        springs, tangents, changes = gravity_springs(rig, linear, structural, settings=settings.model)
        fixed[2] += np.diag(tangents)
        stacks[2][:] += np.array([np.diag(change) for change in changes])
    frictions = frictions_of(own, linear, names, case.identification[0].step, settings=settings.simulation)
    structure = Structure(
        tuple(rig.model.joint(int(rig.model.dof_jntid[dof])).name for dof in linear.dofs),
        names, *stacks, inputs, tuple(channel.name for channel, _ in loads), observers,
        places, fixed, frictions, springs,
    )  # fmt: skip
    return structure, linear


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
        native.coordinate(rig.model, target)
    return f"structure/{kind}/{target}"


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
