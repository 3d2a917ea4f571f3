"""The test to run next on an arm: joint trajectories that would tell two explanations apart, within what the records show it to do.

Candidates are slow and fast, wide and small motions of the joint in question alone and of all joints together. Along each, both
explanations predict every joint; what they differ by, over the encoders' noise, is what the test is expected to bring. The parameters
are those of the fits: a rival that may be fitted anew gives a little more away.
"""

from __future__ import annotations

import io
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import mujoco
import numpy as np
from scipy.stats import norm

from bench import native
from bench.arrays import Array
from bench.discrepancy.articulated_judgement.free_runs import FreeRuns
from bench.discrepancy.articulated_search.fitting import ArticulatedFit
from bench.discrepancy.articulated_search.problem import ArticulatedProblem
from bench.discrepancy.case.case import CaseRecord
from bench.discrepancy.multibody.encoders import encoders_of
from bench.discrepancy.multibody.inputs import input_of, loads_of
from bench.discrepancy.multibody.records import prepare
from bench.discrepancy.settings import ArticulatedNextTestSettings as NextTestSettings


class Trajectory(NamedTuple):
    """Joint trajectories.

    Attributes:
        words: What they are.
        time: (n,) [s].
        position: (n, n_joints) [rad or m].
    """

    words: str
    time: Array
    position: Array

    def as_csv(self, joints: Sequence[tuple[str, str]]) -> str:
        """The trajectories as a table: time, then a column for every joint, given by its name and the unit of its coordinate."""
        text = io.StringIO()
        header = ",".join(["time [s]", *(f"{name} [{unit}]" for name, unit in joints)])
        np.savetxt(
            text,
            np.column_stack([self.time, self.position]),
            delimiter=",",
            header=header,
            comments="",
            fmt="%.9g",
        )
        return text.getvalue()


class JointProposal(NamedTuple):
    """A test that would tell two explanations apart: what a verdict says of it, and the trajectories to run."""

    told: dict[str, Any]
    trajectory: Trajectory


def propose(
    problem: ArticulatedProblem, compiled: mujoco.MjModel, first: ArticulatedFit, second: ArticulatedFit
) -> JointProposal | None:
    """The trajectories on which two explanations differ most; None where none is within the limits, or a joint is only followed.

    Args:
        problem: The records for identification.
        compiled: The user's model, for what of it would collide.
        first: The explanation behind the verdict.
        second: Its closest rival.
    """
    settings = problem.settings.articulated.next_test
    found: list[tuple[float, Trajectory, CaseRecord]] = []
    if problem.model.followed:  # nobody can say how it would move
        return None
    for trajectory in _candidates(problem, first, second, settings):
        record = _record(problem, trajectory)
        if not _within_limits(problem, record) or _collides(compiled, problem, trajectory):
            continue
        odds = _expected(problem, record, first, second)
        if np.isfinite(odds):
            found.append((odds, trajectory, record))
    if not found:
        return None
    odds, trajectory, record = max(found, key=lambda entry: entry[0])
    loads = {input_of(problem.case, joint).name: joint for joint in problem.joints}
    peaks = {name: float(np.abs(record.values[name]).max()) for name in loads}
    told = {
        "separates": [beyond(first, second), beyond(second, first)],
        "reason": "",
        "log_odds_now": first.log_posterior - second.log_posterior,
        "excitation": trajectory.words,
        "duration_s": float(trajectory.time[-1]),
        "expected_log_odds": odds,
        "power": float(
            norm.cdf((odds - settings.decided) / np.sqrt(2.0 * max(odds, 1e-12)))
        ),  # of variance twice the mean
        "peak_loads": peaks,
        "peak_load": max(peaks.values()),
        "largest_response": {
            joint.name: float(np.abs(trajectory.position[:, j]).max())
            for j, joint in enumerate(problem.joints)
        },
    }
    return JointProposal(told, trajectory)


def _candidates(
    problem: ArticulatedProblem, first: ArticulatedFit, second: ArticulatedFit, settings: NextTestSettings
) -> Iterator[Trajectory]:
    """Motions of the joints in question, alone and with the others."""
    step = problem.records[0].joints[0].sample
    time = np.arange(0.0, settings.duration, step)
    low, high, fast = _shown(problem)
    middle, reach = 0.5 * (low + high), 0.5 * (high - low)
    asked = sorted({placed.joint for f in (first, second) for placed in f.hypothesis})
    ends = np.minimum(time, time[-1] - time)  # from rest to rest
    fade = np.sin(0.5 * np.pi * np.minimum(ends / settings.ramp, 1.0)) ** 2
    rest = np.array([record.joints[j].position[0] for record in problem.records[:1] for j in range(len(low))])
    groups = [("all joints", list(range(len(low)))), *((problem.joints[j].name, [j]) for j in asked)]
    for label, moving in groups:
        for part in settings.parts:
            for speed in settings.speeds:
                position = np.tile(rest, (len(time), 1))
                for k, j in enumerate(moving):
                    amplitude = part * reach[j]
                    frequency = min(speed * fast[j] / (2.0 * np.pi * max(amplitude, 1e-9)), settings.highest)
                    frequency *= 1.0 + 0.17 * k  # no two joints in step
                    wave = np.sin(2.0 * np.pi * frequency * time)
                    position[:, j] += fade * (middle[j] - rest[j] + amplitude * wave)
                words = f"{label}: sines of {100.0 * part:.0f} % of the reach and {100.0 * speed:.0f} % of the speed shown"
                yield Trajectory(words, time, position)


def _shown(problem: ArticulatedProblem) -> tuple[Array, Array, Array]:
    """Lowest and highest positions within the ranges, and largest speeds (n_joints,), that the records show."""
    position = np.vstack([record.motion.position for record in problem.records])
    velocity = np.vstack([record.motion.velocity for record in problem.records])
    ranges = np.array([joint.range for joint in problem.joints])
    low, high = np.maximum(position.min(axis=0), ranges[:, 0]), np.minimum(position.max(axis=0), ranges[:, 1])
    return low, high, np.abs(velocity).max(axis=0)


def _record(problem: ArticulatedProblem, trajectory: Trajectory) -> CaseRecord:
    """A record of trajectories that are followed: targets of servos, else the torques that the nominal model asks for."""
    step = float(trajectory.time[1] - trajectory.time[0])
    q = trajectory.position
    v = np.gradient(q, step, axis=0)
    a = np.gradient(v, step, axis=0)
    torque = problem.model.dynamics(q, v, a).torque
    values: dict[str, Array] = {}
    for j, joint in enumerate(problem.joints):
        drive = joint.drive
        assert drive is not None
        needed = torque[:, j] + joint.armature * a[:, j] + joint.damping * v[:, j]
        needed = needed + joint.stiffness * (q[:, j] - joint.reference)
        command = drive.gear * q[:, j] if drive.servo else drive.command(needed, q[:, j], v[:, j])
        values[input_of(problem.case, joint).name] = np.ascontiguousarray(command)
        values |= {channel.name: np.zeros(len(command)) for channel in loads_of(problem.case, joint)}
        measured = encoders_of(problem.case, joint)
        for channel, order in zip(measured.channels, measured.orders, strict=True):
            values[channel.name] = np.ascontiguousarray(v[:, j] if order else q[:, j])
    return CaseRecord("next", step, 0.0, values)


def _within_limits(problem: ArticulatedProblem, record: CaseRecord) -> bool:
    """Whether no torque-driven joint needs more than the records show it to have had."""
    for joint in problem.joints:
        name = input_of(problem.case, joint).name
        most = max(float(np.abs(one.record.values[name]).max()) for one in problem.records)
        if joint.drive is not None and not joint.drive.servo and np.abs(record.values[name]).max() > most:
            return False
    return True


@native.quiet()
def _collides(compiled: mujoco.MjModel, problem: ArticulatedProblem, trajectory: Trajectory) -> bool:
    """Whether geoms of the user's model meet on the way that do not at its beginning."""
    data = mujoco.MjData(compiled)
    settings = problem.settings.articulated.next_test
    before: set[tuple[int, int]] | None = None
    picked = trajectory.position[:: max(1, len(trajectory.position) // settings.poses)]
    for q in problem.model.whole(picked, 0):
        data.qpos[:] = q
        mujoco.mj_kinematics(compiled, data)
        mujoco.mj_collision(compiled, data)
        met = {(int(c.geom[0]), int(c.geom[1])) for c in data.contact[: data.ncon]}
        before = met if before is None else before
        if met - before:
            return True
    return False


def _expected(
    problem: ArticulatedProblem, record: CaseRecord, first: ArticulatedFit, second: ArticulatedFit
) -> float:
    """Expected log odds of the first against the second, were it true: half of the squares of what they differ by, over the noise."""
    prepared = prepare(problem.case, problem.model, record, settings=problem.settings)
    test = ArticulatedProblem(problem.case, problem.model, (prepared,), problem.settings)
    runs, total = FreeRuns(test), 0.0
    for j in range(len(problem.joints)):
        noise = float(prepared.joints[j].noise[0])
        errors = [
            runs.errors(j, f.hypothesis, f.vector, test.motions(f.hypothesis, f.vector)[0])
            for f in (first, second)
        ]
        total += 0.5 * float(np.sum((errors[0] - errors[1]) ** 2)) / noise**2
    return total


def beyond(found: ArticulatedFit, other: ArticulatedFit) -> str:
    """What an explanation names that another does not; all that it names where that is nothing."""
    theirs = {placed.key for placed in other.hypothesis}
    own = [placed for placed in found.hypothesis if placed.key not in theirs]
    return " and ".join(map(str, own or found.hypothesis))
