"""The laboratories in which hidden rigs stand: MuJoCo batches with the native laws, and what their sensors show.

One compiled model holds the elements of all hypotheses. In each laboratory those of the hidden rig are switched on and carry its
parameters; the others are unmarked, so that the native callback passes over them.
"""

from __future__ import annotations

from typing import Any
from xml.etree import ElementTree

import mujoco
import numpy as np
from mujoco.batch import Batch
from numpy.typing import NDArray

from bench import native
from bench.errors import ModelError
from bench.excitation.linear_structure import sensor_columns
from bench.excitation.prior import Draw, RigHypothesis
from bench.rig import Rig

EXPANDED = {"stiffness": "jnt_stiffness", "damping": "dof_damping"}
"""Structural quantities that may differ between laboratories, and MuJoCo's fields for them."""


def combined(hypotheses: tuple[RigHypothesis, ...], channels: tuple[str, ...]) -> Rig:
    """The rig of the first hypothesis with the elements of all, and nothing that the laboratories do not need."""
    first = hypotheses[0].rig
    elements = {element.name: element for hypothesis in hypotheses for element in hypothesis.rig.elements}
    for hypothesis in hypotheses:
        for element in hypothesis.rig.elements:
            if element.law is not elements[element.name].law or hypothesis.rig.mjcf != first.mjcf:
                raise ModelError(
                    f"hypothesis '{hypothesis.name}' has another law under the name '{element.name}', or another model; "
                    "laboratories of one environment share their MJCF and name each law's element differently"
                )
    rig = first.with_(mjcf=stripped(first.mjcf, channels), elements=tuple(elements.values()))
    if _unconstrained(rig.model):
        rig.model.opt.disableflags |= (
            mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
        )  # nothing to look for: 6 % of a step
    return rig


def _unconstrained(model: mujoco.MjModel) -> bool:
    """Whether nothing in a model can ever give a constraint force."""
    limited = model.jnt_limited.any() or model.tendon_limited.any()
    dry = model.dof_frictionloss.any() or model.tendon_frictionloss.any()
    touching = (model.geom_contype.any() and model.geom_conaffinity.any()) or model.npair
    return not (limited or dry or touching or model.neq)


def stripped(mjcf: str, channels: tuple[str, ...]) -> str:
    """MJCF text without sensors that are not read and without sites that nothing refers to."""
    root = ElementTree.fromstring(mjcf)
    for section in root.findall("sensor"):
        for sensor in list(section):
            name = sensor.get("name", "")
            if not any(channel == name or channel.startswith(name + "_") for channel in channels):
                section.remove(sensor)
    sections = [section for section in root if section.tag != "worldbody"]
    used = {value for section in sections for node in section.iter() for value in node.attrib.values()}
    for parent in list(root.iter()):
        for site in parent.findall("site"):
            if parent.tag != "default" and site.get("name") not in used:
                parent.remove(site)
    return ElementTree.tostring(root, encoding="unicode")


class Laboratories:
    """Hidden rigs side by side in one MuJoCo batch.

    Attributes:
        n: Number of laboratories.
    """

    def __init__(
        self,
        hypotheses: tuple[RigHypothesis, ...],
        n: int,
        *,
        channels: tuple[str, ...],
        actuators: tuple[str, ...],
        threads: int = 1,
    ) -> None:
        """Set up laboratories, with no rig in them yet.

        Args:
            hypotheses: Everything that may be hidden.
            n: Number of laboratories.
            channels: Names of the measured channels.
            actuators: Names of the driven actuators.
            threads: Threads of the batch.
        """
        self.n = n
        self._arguments = (hypotheses, n, channels, actuators, threads)
        self._rig = combined(hypotheses, channels)
        built = self._rig.built
        self._placed = {item.element.name: item for item in built.placed}
        self._columns = sensor_columns(self._rig, channels)
        self._driven = [self._rig.actuators.index(name) for name in actuators]
        self._batch = Batch(built.model, n, threads)
        self._numbers = self._batch.expand("numeric_data")
        self._silent = built.model.numeric_data.copy()
        starts = np.asarray(built.model.numeric_adr)
        self._marks = {}
        for name, item in self._placed.items():
            self._marks[name] = int(starts[starts <= item.theta].max())
            self._silent[self._marks[name]] = 0.0
        self._structure = {}
        for hypothesis in hypotheses:
            for quantity, place in _structural(hypothesis):
                if quantity not in EXPANDED:
                    raise ModelError(
                        f"'{quantity}:{place}' cannot differ between laboratories; possible are {', '.join(EXPANDED)} of joints"
                    )
                self._structure[quantity] = self._batch.expand(EXPANDED[quantity])

    def install(self, place: int, draw: Draw) -> None:
        """Put a rig, at rest, into a laboratory."""
        rig, model = draw.rig, self._rig.model
        row = self._silent.copy()
        start = np.zeros(model.na)
        for element in rig.elements:
            item = self._placed[element.name]
            row[self._marks[element.name]] = native.MAGIC
            row[item.theta : item.theta + len(element.theta)] = element.theta
            if item.act >= 0:
                start[item.act : item.act + len(element.law.states)] = element.law.start()
        self._numbers[place] = row
        for quantity, joint, value in rig.structure:
            if quantity in self._structure:
                joint_id = model.joint(joint).id
                at = joint_id if quantity == "stiffness" else int(model.jnt_dofadr[joint_id])
                self._structure[quantity][place].reshape(-1)[at] = value
        self._batch.state[place] = 0.0
        self._batch.bind("qpos")[place] = model.qpos0
        self._batch.bind("act")[place] = start

    def run(self, places: NDArray[np.int64], controls: NDArray[np.float64]) -> NDArray[np.float64]:
        """Drive laboratories and return what ideal sensors show.

        Args:
            places: Laboratories, ascending ``(m,)``.
            controls: Commands ``(m, n_steps, n_actuators)``.

        Returns:
            Channels ``(m, n_steps, n_channels)`` at the start of each step.
        """
        m, n_steps, _ = controls.shape
        full = np.zeros((m, n_steps, self._rig.model.nu))
        full[:, :, self._driven] = controls
        with native.running(self._rig.model):
            record = self._batch.rollout(
                n_steps,
                full,
                mujoco.mjtState.mjSTATE_CTRL,
                ["sensordata"],
                ids=None if m == self.n else places,
            )
        return record["sensordata"][:, :, self._columns]

    def positions(self, place: int) -> NDArray[np.float64]:
        """Joint positions of a laboratory's rig, to be looked at."""
        return self._batch.bind("qpos")[place].copy()

    def __getstate__(self) -> dict[str, Any]:
        structure = {quantity: values.copy() for quantity, values in self._structure.items()}
        return {
            "arguments": self._arguments,
            "state": self._batch.state.copy(),
            "numbers": self._numbers.copy(),
            "structure": structure,
        }

    def __setstate__(self, saved: dict[str, Any]) -> None:
        hypotheses, n, channels, actuators, threads = saved["arguments"]
        self.__init__(hypotheses, n, channels=channels, actuators=actuators, threads=threads)
        self._batch.state[:] = saved["state"]
        for (
            name,
            item,
        ) in (
            self._placed.items()
        ):  # law numbers hold in one process, addresses in one model: theta alone is taken
            mark, theta = self._marks[name], slice(item.theta, item.theta + len(item.element.theta))
            self._numbers[:, mark] = np.where(saved["numbers"][:, mark] == native.MAGIC, native.MAGIC, 0.0)
            self._numbers[:, theta] = saved["numbers"][:, theta]
        for quantity, values in saved["structure"].items():
            self._structure[quantity][:] = values


def _structural(hypothesis: RigHypothesis) -> list[tuple[str, str]]:
    pairs = [name.partition(":") for name in hypothesis.names if "." not in name]
    return [(quantity, place) for quantity, _, place in pairs]
