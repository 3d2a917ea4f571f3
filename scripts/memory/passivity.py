"""A million closed-loop steps with joints whose weights are drawn, not learned: does any of them give out energy?

Each of forty joints, of either form, sits between the two bodies of the joint rig. Random loads drive it through the first half of a
run; then it is left alone, and what it and the structure hold must not rise from step to step. A rise is reported as a share of what
they held at most; Runge-Kutta steps over the kinks of a yielding element leave some.
"""

from __future__ import annotations

import numpy as np

from bench.laws.memory import memory_law
from bench.laws.memory_energy import stored_energy
from bench.laws.memory_layout import Direction, MemoryLayout
from bench.recording import Recording
from bench.rig import Element, Rig, simulate
from bench.rig.library import joint_rig
from memory.row import Progress, Row

JOINTS, STEPS = 40, 25_000
AXES = ("axial", "torsional")
ARM = 0.0254
"""What a metre of the torsional directions is a radian times [m]: the rig's torsion is its axial half times the square of an inch."""
LIMIT = 1e-4
"""Largest rise in a step over the energy held at most: the local error of a step of 1 ms over a kink."""


def drawn(rng: np.random.Generator, profile: int) -> tuple[MemoryLayout, np.ndarray]:
    """A layout with every kind of term along three directions, and parameters anywhere within their bounds."""
    directions = (
        Direction((1.0, 0.0), -0.012, 0.014, 1.0),
        Direction((0.0, ARM), -0.012, 0.01, 0.5),
        Direction((1.0, ARM), -0.02, 0.02, 1.0),
    )
    layout = MemoryLayout(
        2, directions, potentials=(0, 1, 2), gated=((0, 1), (1, 0), (2, 2)), speeds=(0, 1), slips=(0, 0, 1, 1, 2),
        maxwells=(0, 1), cells=6, knots=4, speed_knots=3, parts=3, profile=profile,
    )  # fmt: skip
    size = {"k": 2e4, "s": 1e5, "km": 2e4, "c": 100.0, "d": 100.0}
    values = []
    for parameter in memory_law(layout).parameters:
        kind = parameter.name.partition("[")[0].rstrip("0123456789")
        if parameter.bounds[1] == 1.0:
            values.append(rng.uniform(0.0, 1.0))
        elif kind == "r":
            values.append(parameter.default * 10.0 ** rng.uniform(-1.0, 0.5))
        elif kind == "tau":
            values.append(10.0 ** rng.uniform(-2.0, 0.0))
        else:
            values.append(size[kind] * rng.exponential() * (rng.random() < 0.7))
    return layout, np.array(values)


def rows(progress: Progress) -> list[Row]:
    """Rows of the task."""
    worst, ended = 0.0, -np.inf
    for number in range(JOINTS):
        progress(f"joint {number + 1} of {JOINTS}")
        rng = np.random.default_rng(number)
        layout, values = drawn(rng, 4 * (number % 2))
        law = memory_law(layout)
        element = Element(law, AXES, law.theta(values), name="joint")
        rig = joint_rig(element)
        loads = rng.normal(size=(STEPS // 50, 2)).repeat(50, axis=0) * [2000.0, 50.0]
        loads[STEPS // 2 :] = 0.0
        record = simulate(rig, {"force": loads[:, 0], "torque": loads[:, 1]})
        memory = np.stack([record[f"joint/{state.partition(' ')[0]}"] for state in law.states], axis=1)
        q = np.stack([record["joint/displacement_1"], record["joint/displacement_2"]], axis=1)
        held = stored_energy(layout, values, q, memory) + _structure(rig, record)
        free = held[STEPS // 2 + 1 :]
        worst = max(worst, float(np.max(np.diff(free)) / np.max(np.abs(held - held.min()))))
        ended = max(ended, float((free[-1] - free[0]) / np.max(np.abs(held - held.min()))))
    task, steps = "passivity", JOINTS * STEPS
    return [
        Row(task, "random joints with memory", "steps in closed loop", float(steps), "1", 1e6, least=True),
        Row(
            task,
            "random joints with memory",
            "largest rise of the energy in an unloaded step, of the most held",
            worst,
            "1",
            LIMIT,
        ),
        Row(
            task,
            "random joints with memory",
            "energy gained over an unloaded run, of the most held",
            ended,
            "1",
            0.0,
        ),
    ]


def _structure(rig: Rig, record: Recording) -> np.ndarray:
    """Kinetic energy of the bodies and energy of their mounts (n,) [J]."""
    model = rig.model
    total = np.zeros(len(record.time))
    for place, rate, joint in (
        ("displacement_1", "velocity_1", "axial_1"), ("rotation_1", "rotation_rate_1", "torsional_1"),
        ("displacement_2", "velocity_2", "axial_2"), ("rotation_2", "rotation_rate_2", "torsional_2"),
    ):  # fmt: skip
        dof = model.joint(joint)
        total += (
            0.5 * model.dof_M0[int(dof.dofadr[0])] * record[rate] ** 2
            + 0.5 * float(dof.stiffness[0]) * record[place] ** 2
        )
    return total
