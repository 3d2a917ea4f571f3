"""Runs that no encoder corrects, and how far noise alone leaves them from the log.

They judge: an explanation predicts the judging records from their commands or torques, window by window where no servo holds the joint.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.interpolate import CubicSpline

from bench.arrays import Array
from bench.discrepancy.articulated_effects.hypothesis import JointHypothesis
from bench.discrepancy.articulated_search.problem import ArticulatedProblem
from bench.discrepancy.multibody.encoders import travel
from bench.discrepancy.multibody.inputs import input_of, noise_of_loads
from bench.discrepancy.multibody.joint_forces import Slot
from bench.discrepancy.multibody.joint_record import judged_from
from bench.discrepancy.multibody.motion import clock_of
from bench.discrepancy.multibody.noise import NoiseDraw, NoiseSettings, draw
from bench.discrepancy.multibody.records import PreparedRecord


@dataclass(frozen=True, eq=False)
class FreeRuns:
    """Free runs of the joints of a problem.

    Attributes:
        problem: Its records and their motion.
    """

    problem: ArticulatedProblem

    def errors(self, j: int, hypothesis: JointHypothesis, vector: Array, prepared: PreparedRecord) -> Array:
        """Logged less predicted positions (n,) of joint `j`, run without corrections from the measured states of its windows.

        What no encoder tells at the start of a window, the winding of an elastic drive, is taken from the run that is corrected.
        Samples before `judged_from` are left out.
        """
        record, motion = prepared.joints[j], prepared.motion
        every = record.window or len(record.position)
        states = np.column_stack([motion.position[:, j], motion.velocity[:, j]])
        if record.encoder.delay:  # the run keeps the clock of the log, which shows what the joint did before
            samples = np.arange(len(states)) * record.sample
            late = np.maximum(samples - record.encoder.delay, 0.0)
            states = CubicSpline(samples, states, axis=0)(late)
        starts = states[::every]
        if any(placed.effect.train and placed.joint == j for placed in hypothesis):
            _, states = self.problem.innovations(j, hypothesis, vector, prepared)
            starts = np.hstack([starts, states[::every, 2:] - states[::every, :2]])
        out, _ = self.problem.run(j, hypothesis, vector, record, np.zeros((2, 2)), starts, every)
        return (1.0 + record.encoder.gain) * out[judged_from(record.window, len(record.position)) :, 0]

    @cached_property
    def sizes(self) -> Array:
        """What errors of the joints (n_joints,) are divided by, see `travel`."""
        problem = self.problem
        noise = [
            max(float(np.max(r.joints[j].noise)) for r in problem.records) for j in range(len(problem.joints))
        ]
        return np.array(
            [travel(problem.case, joint, one) for joint, one in zip(problem.joints, noise, strict=True)]
        )

    def metric(self, j: int) -> str:
        """What is told of joint `j`, in words."""
        joint, record = self.problem.joints[j], self.problem.records[0].joints[j]
        run = f"free runs of {record.window * record.sample:.3g} s" if record.window else "free run"
        return f"validation {joint.name} position NRMSE, {run}, other joints as measured"

    def weight(self, j: int, hypothesis: JointHypothesis, vector: Array) -> float:
        """How far a torque moves joint `j` within a window with the inertia as stated, over how far with that of a hypothesis.

        A joint made heavier errs less by any torque that it misses, and explains no more of it. One where a servo holds it.
        """
        inertias, window = list[tuple[float, float]](), 0.0
        p, numbers = self.problem.parameters(j, hypothesis, vector)
        damping = max(float(p[Slot.DAMPING]), 0.0)
        for prepared in self.problem.records:
            record = prepared.joints[j]
            _, inertia = record.coefficients(numbers)
            inertias.append((float(np.mean(record.inertia)), float(np.mean(inertia)) + p[Slot.INERTIA]))
            window = record.window * record.sample
        if not window:
            return 1.0
        stated, found = np.mean(inertias, axis=0)
        return _moved(stated, damping, window) / _moved(found, damping, window)

    @cached_property
    def draws(self) -> tuple[tuple[NoiseDraw, ...], ...]:
        """Draws of the noise of every record."""
        settings = NoiseSettings()
        rng = np.random.default_rng(settings.seed)
        return tuple(
            tuple(
                draw(
                    self.problem.model,
                    prepared.motion,
                    clock_of(prepared.record, settings=self.problem.settings.articulated),
                    rng,
                )
                for _ in range(settings.draws)
            )
            for prepared in self.problem.records
        )

    def noise(self, j: int, hypothesis: JointHypothesis, vector: Array, r: int) -> float:
        """RMS error of the position that noise alone leaves in a free run of joint `j` in record `r`, were the hypothesis true."""
        prepared = self.problem.motions(hypothesis, vector)[r]
        record, rng = prepared.joints[j], np.random.default_rng(NoiseSettings().seed + 1 + j)
        drive = record.joint.drive
        channel = input_of(self.problem.case, record.joint)
        stated = 0.0 if drive is None or drive.servo else channel.noise_std or 0.0
        pushed = noise_of_loads(self.problem.case, record.joint)
        quiet = self.errors(j, hypothesis, vector, prepared)
        total = []
        for one in self.draws[r]:
            kicks = np.repeat(stated * rng.standard_normal(len(record.position) - 1), record.n_sub)
            # drawn last and only where there are loads, so that the draws of others stay theirs
            shocks = (
                rng.standard_normal(len(record.position) - 1)
                if pushed
                else np.zeros(len(record.position) - 1)
            )
            pushes = np.repeat(pushed * shocks, record.n_sub)
            noisy = replace(
                record, bias=record.bias + one.bias[j] - pushes, reference=record.reference + one.reference[j],
                command=record.command + kicks,
            )  # fmt: skip
            motion = prepared.motion._replace(
                position=prepared.motion.position + one.motion[0],
                velocity=prepared.motion.velocity + one.motion[1],
            )
            joints = (*prepared.joints[:j], noisy, *prepared.joints[j + 1 :])
            loud = self.errors(j, hypothesis, vector, replace(prepared, joints=joints, motion=motion))
            total.append(np.mean((loud - quiet) ** 2))
        return float(np.sqrt(np.mean(total) + record.noise[0] ** 2))


def _moved(inertia: float, damping: float, time: float) -> float:
    """How far a unit force moves a damped inertia from rest within a time."""
    x = damping * time / inertia
    # (x - 1 + exp(-x)) / x^2 of T^2 / M, a half where nothing damps
    part = 0.5 - x / 6.0 if x < 1e-3 else (x - 1.0 + np.exp(-x)) / x**2
    return float(time**2 / inertia * part)
