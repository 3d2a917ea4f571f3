"""A linear structure as an MJCF model."""

from __future__ import annotations

import numpy as np

from bench.arrays import Array
from bench.discrepancy.model.structure import Structure


class StructureMjcf:
    """A structure as an MJCF model: a slide joint a degree of freedom, a fixed tendon a relative coordinate."""

    def __init__(self, structure: Structure) -> None:
        self.structure = structure
        self.names: dict[tuple[float, ...], str] = {}
        for i, dof in enumerate(structure.dofs):
            self.names[tuple(float(i == j) for j in range(len(structure.dofs)))] = dof
        for place in structure.places:
            for row in place.rows:
                self.names.setdefault(tuple(row), f"relative_{len(self.names)}")

    def of(self, matrix: Array) -> str:
        """Coordinate whose square a rank-one matrix is."""
        return next(name for row, name in self.names.items() if np.array_equal(np.outer(row, row), matrix))

    def mjcf(self, *, solver: bool = True) -> str:
        """The model, with unit masses and neither springs nor dampers, and without the constraint solver where nothing needs it."""
        dofs = self.structure.dofs
        bodies = "".join(
            f'<body name="{dof}" pos="0 {i} 0"><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>'
            f'<joint name="{dof}" type="slide" axis="1 0 0"/></body>'
            for i, dof in enumerate(dofs)
        )
        tendons = "".join(
            f'<fixed name="{name}" springlength="0">'
            + "".join(
                f'<joint joint="{dof}" coef="{c}"/>' for dof, c in zip(dofs, row, strict=True) if c != 0.0
            )
            + "</fixed>"
            for row, name in self.names.items()
            if name not in dofs
        )
        motors = "".join(
            f'<motor name="{load}" joint="{dofs[int(np.flatnonzero(self.structure.inputs[:, j])[0])]}"/>'
            for j, load in enumerate(self.structure.loads)
        )
        sensors = "".join(
            f'<jointpos name="{dof}_position" joint="{dof}"/><jointvel name="{dof}_velocity" joint="{dof}"/>'
            f'<framelinacc name="{dof}_acceleration" objtype="body" objname="{dof}"/>'
            for dof in dofs
        )
        return (
            '<mujoco><option gravity="0 0 0"><flag contact="disable"'
            + ("" if solver else ' constraint="disable"')
            + "/></option>"
            f"<worldbody>{bodies}</worldbody>"
            + (f"<tendon>{tendons}</tendon>" if tendons else "")
            + f"<actuator>{motors}</actuator><sensor>{sensors}</sensor></mujoco>"
        )
