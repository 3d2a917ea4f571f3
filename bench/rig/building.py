"""From a description to a compiled model: elements, hidden states and structural changes put into the MJCF."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple, Protocol
from xml.etree import ElementTree

import mujoco
import numpy as np
from numpy.typing import NDArray

from bench import native
from bench.errors import ModelError, ParameterError, UnknownNameError
from bench.native import Coordinate
from bench.rig.element import Element
from bench.rig.mjcf_files import included_files
from bench.rig.structure import structure_address

INTEGRATORS = {
    "RK4": mujoco.mjtIntegrator.mjINT_RK4,
    "Euler": mujoco.mjtIntegrator.mjINT_EULER,
    "implicit": mujoco.mjtIntegrator.mjINT_IMPLICIT,
    "implicitfast": mujoco.mjtIntegrator.mjINT_IMPLICITFAST,
}


@dataclass(frozen=True)
class BuildingSettings:
    """Numbers of `bench.rig.building`."""

    exact_solimp: tuple[float, ...] = (0.9999, 0.9999, 0.001, 0.5, 2.0)


SETTINGS = BuildingSettings()


class Buildable(Protocol):
    """What of a rig a model is built from; `bench.rig.Rig` says what each is."""

    @property
    def name(self) -> str:
        """Name, for messages."""
        ...

    @property
    def mjcf(self) -> str:
        """The model as MJCF text."""
        ...

    @property
    def folder(self) -> str:
        """Folder that meshes and includes are looked for in."""
        ...

    @property
    def timestep(self) -> float:
        """Integration step [s]."""
        ...

    @property
    def integrator(self) -> str:
        """One of `INTEGRATORS`."""
        ...

    @property
    def elements(self) -> tuple[Element, ...]:
        """The elements."""
        ...

    @property
    def structure(self) -> tuple[tuple[str, str, float], ...]:
        """Changes of the MJCF's own numbers."""
        ...


class PlacedElement(NamedTuple):
    """An element in a compiled model."""

    element: Element
    coordinates: tuple[Coordinate, ...]
    act: int  # address of the first hidden state, −1 for none
    theta: int  # address of theta[0] in numeric_data


class Built(NamedTuple):
    """A compiled rig."""

    model: mujoco.MjModel
    placed: tuple[PlacedElement, ...]
    actuators: tuple[str, ...]  # the rig's own, without those that carry hidden states


def parse(text: str, folder: str, label: str) -> mujoco.MjSpec:
    """Read MJCF text; meshes and includes are looked for in `folder`.

    Raises:
        ModelError: It is no valid MJCF.
    """
    try:
        with native.quiet():
            spec = mujoco.MjSpec.from_string(text, include=included_files(text, Path(folder)))
    except (ValueError, ElementTree.ParseError) as error:
        raise ModelError(f"the MJCF of {label} cannot be read: {error}") from error
    if folder:
        spec.modelfiledir = folder
    return spec


def specify(rig: Buildable, built: Built | None = None) -> mujoco.MjSpec:
    """The rig as an MjSpec, its elements' rows empty, or as they are in `built`."""
    spec = parse(rig.mjcf, rig.folder, f"rig '{rig.name}'")
    _refuse_foreign_elements(spec, rig)
    spec.option.timestep = rig.timestep
    spec.option.integrator = INTEGRATORS[rig.integrator]
    spec.option.disableflags |= (
        mujoco.mjtDisableBit.mjDSBL_AUTORESET
    )  # a divergence is to be reported, not hidden
    for index, element in enumerate(rig.elements):
        if element.exact:
            _set_exact_friction(spec, element)
            continue
        data = np.zeros(native.row_size(element.law))
        if built is not None:
            numeric = mujoco.mj_name2id(
                built.model, mujoco.mjtObj.mjOBJ_NUMERIC, native.PREFIX + element.name
            )
            start = int(built.model.numeric_adr[numeric])
            data = built.model.numeric_data[start : start + int(built.model.numeric_size[numeric])].copy()
            data[native.OWN] = native.UNBOUND
        spec.add_numeric(name=native.PREFIX + element.name, data=data, size=len(data))
        if element.law.states:
            _add_state_actuator(spec, element, index)
    return spec


def _refuse_foreign_elements(spec: mujoco.MjSpec, rig: Buildable) -> None:
    """Refuse MJCF that marks something of its own as an element: law numbers and addresses are no matter of a file."""
    marked = [f"numeric '{item.name}'" for item in spec.numerics if _is_marked(item.name, item.data)]
    marked += [
        f"actuator '{item.name}'"
        for item in spec.actuators
        if _is_marked(item.name, item.dynprm if item.dyntype == mujoco.mjtDyn.mjDYN_USER else ())
    ]
    if marked:
        raise ModelError(
            f"the MJCF of rig '{rig.name}' marks {', '.join(marked[:3])} as an element of the bench (a name that begins with "
            f"'{native.PREFIX}', or the first number {native.MAGIC:.0f}); elements belong to the rig, not to its MJCF. Remove it there "
            "and give the rig the element; a model exported by Rig.to_xml is loaded by MuJoCo itself and bench.native.bind"
        )


def _is_marked(name: str, numbers: Sequence[float] | NDArray[np.float64]) -> bool:
    return name.startswith(native.PREFIX) or (len(numbers) > 0 and numbers[0] == native.MAGIC)


def _leave_out_drawings(spec: mujoco.MjSpec, shapes: bool) -> None:
    """Have MuJoCo keep what moves, collides or is sensed, and nothing that is only drawn: half the time of a step.

    With `shapes`, geoms that are only drawn stay.
    """
    spec.compiler.discardvisual = not shapes
    spec.compiler.fusestatic = True
    sensed = {int(kind) for sensor in spec.sensors for kind in (sensor.objtype, sensor.reftype)}
    seen = [] if int(mujoco.mjtObj.mjOBJ_CAMERA) in sensed else list(spec.cameras)
    for drawing in [*spec.lights, *seen]:
        spec.delete(drawing)


def _set_exact_friction(spec: mujoco.MjSpec, element: Element) -> None:
    target = spec.joint(element.joints[0]) or spec.tendon(element.joints[0])
    if target is None:
        raise UnknownNameError("joint or tendon", element.joints[0], [joint.name for joint in spec.joints])
    target.frictionloss = element.theta[0]
    target.solref_friction = (2.0 * spec.option.timestep, 1.0)  # the stiffest that MuJoCo takes at this step
    target.solimp_friction = SETTINGS.exact_solimp


def _add_state_actuator(spec: mujoco.MjSpec, element: Element, index: int) -> None:
    """A user actuator without gain whose activations are the element's hidden states."""
    transmission = (
        mujoco.mjtTrn.mjTRN_JOINT if spec.joint(element.joints[0]) is not None else mujoco.mjtTrn.mjTRN_TENDON
    )
    actuator = spec.add_actuator(
        name=native.PREFIX + element.name, target=element.joints[0], trntype=transmission
    )
    actuator.dyntype = mujoco.mjtDyn.mjDYN_USER
    actuator.actdim = len(element.law.states)
    actuator.gaintype = mujoco.mjtGain.mjGAIN_FIXED
    actuator.gainprm[0] = 0.0
    actuator.biastype = mujoco.mjtBias.mjBIAS_NONE


def build(rig: Buildable, *, drawings: bool = False, shapes: bool = False) -> Built:
    """Compile a rig, with or without what is only drawn, or the drawn geoms of it; see `Rig.built` for what it raises."""
    native.install()
    with native.quiet():
        return _build(rig, drawings, shapes)


def _build(rig: Buildable, drawings: bool, shapes: bool) -> Built:
    spec = specify(rig)
    if not drawings:
        _leave_out_drawings(spec, shapes)
    own = tuple(actuator.name for actuator in spec.actuators if not actuator.name.startswith(native.PREFIX))
    for name in own:
        if not name:
            raise ModelError(
                f"rig '{rig.name}' has an actuator without a name; excitations address actuators by name"
            )
    for element in rig.elements:  # before compiling: MuJoCo's own message would not name the element
        _check_targets(spec, rig, element)
    try:
        model = spec.compile()
    except ValueError as error:
        raise ModelError(f"the MJCF of rig '{rig.name}' does not compile: {error}") from error
    placed = []
    for element in rig.elements:
        coordinates = tuple(native.coordinate(model, joint) for joint in element.joints)
        coordinates += tuple(native.coordinate(model, name, is_input=True) for name in element.inputs)
        act = theta = -1
        if not element.exact:
            act = native.claim_states(model, element.name) if element.law.states else -1
            theta = native.write_row(model, element.name, element.law, coordinates, element.theta, act)
        placed.append(PlacedElement(element, coordinates, act, theta))
    for kind, name, value in rig.structure:
        _set_structure(model, kind, name, value)
    if rig.structure:
        mujoco.mj_setConst(model, mujoco.MjData(model))
    return Built(model, tuple(placed), own)


def _check_targets(spec: mujoco.MjSpec, rig: Buildable, element: Element) -> None:
    known = [joint.name for joint in spec.joints] + [tendon.name for tendon in spec.tendons]
    for joint in element.joints:
        if joint not in known:
            raise UnknownNameError(
                f"joint or tendon of rig '{rig.name}' (element '{element.name}')", joint, known
            )


def _set_structure(model: mujoco.MjModel, kind: str, name: str, value: float) -> None:
    if not np.isfinite(value) or (value < 0.0 and kind != "stiffness") or (value == 0.0 and kind == "mass"):
        raise ParameterError(f"{kind} of '{name}' is {value}; a finite, positive value is expected")
    structure_address(model, kind, name).write(model, value)
