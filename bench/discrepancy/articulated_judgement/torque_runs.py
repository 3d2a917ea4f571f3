"""The torque that joints miss along their measured motion, for judging models that are too wrong to be run.

The counterpart of `FreeRuns` for a `TorqueProblem`: an explanation predicts the torques of the judging records from their motion.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bench.arrays import Array
from bench.discrepancy.articulated_effects.hypothesis import JointHypothesis
from bench.discrepancy.articulated_judgement.torque_error import TorqueProblem
from bench.discrepancy.multibody.inputs import input_of
from bench.discrepancy.multibody.records import PreparedRecord


@dataclass(frozen=True, eq=False)
class TorqueRuns:
    """Missing torques of the joints of a problem; methods as of `FreeRuns`.

    Attributes:
        problem: Its records and their motion.
    """

    problem: TorqueProblem

    def errors(self, j: int, hypothesis: JointHypothesis, vector: Array, prepared: PreparedRecord) -> Array:
        """Logged less predicted torque (n_intervals,) of joint `j`, means over short intervals."""
        (r,) = [r for r, mine in enumerate(self.problem.records) if mine.record is prepared.record]
        return self.problem.missing(j, hypothesis, vector, r, prepared)

    @cached_property
    def sizes(self) -> Array:
        """What errors of the joints (n_joints,) are divided by: the torque of their drives, RMS over all records of the case."""
        case, sizes = self.problem.case, list[float]()
        for joint in self.problem.joints:
            drive, channel = joint.drive, input_of(case, joint)
            assert drive is not None
            torques = [np.mean(r.values[channel.name] ** 2) for r in (*case.identification, *case.validation)]
            sizes.append(float(np.sqrt(np.mean(torques))) * abs(drive.gear * drive.kp) or 1.0)
        return np.array(sizes)

    def noise(self, j: int, hypothesis: JointHypothesis, vector: Array, r: int) -> float:
        """RMS torque that noise alone leaves of joint `j` in record `r`."""
        return float(self.problem.levels[r].torque[j])

    def weight(self, j: int, hypothesis: JointHypothesis, vector: Array) -> float:
        """One: a torque is a torque, whatever it moves."""
        return 1.0

    def metric(self, j: int) -> str:
        """What is told of joint `j`, in words."""
        return f"validation {self.problem.joints[j].name} torque NRMSE, along the measured motion"
