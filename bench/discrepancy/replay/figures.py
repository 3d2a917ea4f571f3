"""What a run of the judging records in the user's simulator leaves, joint by joint."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Figure:
    """One judged coordinate in the user's simulator.

    Attributes:
        dof: Degree of freedom.
        before: NRMSE with the model as it came, as the user runs it.
        after: With the corrected one.
        diagnosis: What the diagnosis says of the latter.
        floor: What noise alone leaves.
    """

    dof: str
    before: float
    after: float
    diagnosis: float
    floor: float

    @property
    def short(self) -> float:
        """Part of the diagnosis's figure by which the corrected model misses it."""
        return self.after / max(self.diagnosis, 1e-12) - 1.0


@dataclass(frozen=True)
class WholeRun:
    """One joint while all are free at once, as where the model is used.

    Attributes:
        dof: The joint.
        before: NRMSE with the model as it came, from the measured states of windows where no servo holds it.
        after: With the corrected one.
    """

    dof: str
    before: float
    after: float
