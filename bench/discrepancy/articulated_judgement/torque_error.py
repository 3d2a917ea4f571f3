"""The statistical problem of a model that is too wrong to be run: the torque that it misses along the measured motion.

A joint without its friction runs away from the log within a second. Between two such runs the encoder's innovations prefer the one that
moves least: a joint made many times heavier follows no torque, and so hardly errs. What a controller does to keep a joint on its path is
the torque, and torque is what a wrong model of a moving joint cannot account for. So every term of the joint's equation is taken along the
smoothed motion, and what is missing is averaged over short intervals,

    e_k = 1/T ∫ (tau - M q'' - b - f(q, q', z)) dt,

the equation error in its integral form, in which the noise of the acceleration is that of two velocities. It is linear in masses,
friction, damping and rotors: a search that takes one effect after the other goes the right way from however far. The whole of its power
is weighed together: a record holds as many samples of a wrong model as all its octaves
(`bench.discrepancy.articulated_search.misfit`), of which the lowest have fewer ordinates than that.

References:
    J. Swevers, W. Verdonck, J. De Schutter, Dynamic model identification for industrial robots, IEEE Control Systems 27 (2007) 58-71;
    M. Gautier, P. Poignet, Extended Kalman filtering and weighted least squares dynamic identification of robot, Control Engineering
    Practice 9 (2001) 1361-1372 (noise in the states biases the equation error, which is why it is used where models are far off alone).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple
from weakref import WeakKeyDictionary

import numpy as np
from scipy.signal import welch

from bench.arrays import Array
from bench.discrepancy.articulated_effects.hypothesis import JointHypothesis, PlacedOnJoint
from bench.discrepancy.articulated_search.misfit import Octaves
from bench.discrepancy.articulated_search.problem import ALL, ArticulatedProblem
from bench.discrepancy.multibody.inputs import input_of
from bench.discrepancy.multibody.joint_forces import Slot
from bench.discrepancy.multibody.joint_torque import missing_torque
from bench.discrepancy.multibody.motion import clock_of
from bench.discrepancy.multibody.noise import NoiseSettings, draw
from bench.discrepancy.multibody.nominal_parameters import base_slots
from bench.discrepancy.multibody.records import PreparedRecord


class _Level(NamedTuple):
    """What noise leaves in a record: torque (n_joints,) of an interval, and the speeds (n_joints,) below which it hides a direction."""

    torque: Array
    speed: Array


@dataclass(eq=False)
class TorqueProblem(ArticulatedProblem):
    """An `ArticulatedProblem` whose residuals are missing torques along the measured motion; without elastic drives."""

    _moved: WeakKeyDictionary[PreparedRecord, Array] = field(init=False, default_factory=WeakKeyDictionary)

    @classmethod
    def like(cls, problem: ArticulatedProblem) -> TorqueProblem:
        """The same records and priors; one step a sample, since nothing is integrated."""
        how = replace(problem.settings.articulated, longest_step=problem.settings.articulated.longest_sample)
        records = [prepared.record for prepared in problem.records]
        settings = replace(problem.settings, articulated=how)
        return cls.of(problem.case, problem.model, records, settings, problem.deadline)

    def softened(self, level: float) -> ArticulatedProblem:
        """Itself: nothing is run that could forget."""
        return self

    def settled(self, hypothesis: JointHypothesis, vector: Array) -> ArticulatedProblem:
        """Itself: it has no elastic drives."""
        return self

    @cached_property
    def intervals(self) -> tuple[int, ...]:
        """Samples of an interval, record by record."""
        how = self.settings.articulated
        highest = [min(how.followed, self._highest(prepared)) for prepared in self.records]
        pairs = zip(highest, self.records, strict=True)
        return tuple(max(1, round(how.averaged / (f * prepared.record.step))) for f, prepared in pairs)

    def _highest(self, prepared: PreparedRecord) -> float:
        """Frequency [Hz] above which the logged torques hold less than their noise: what is faster was filtered out of them."""
        step, found = prepared.record.step, []
        for joint in self.joints:
            channel = input_of(self.case, joint)
            samples = prepared.record.values[channel.name]
            length = max(2 * len(samples) // self.settings.articulated.segments, 2)
            frequency, power = welch(samples, 1.0 / step, nperseg=length)
            noise = 2.0 * step * (channel.noise_std or 0.0) ** 2
            heard = frequency[power >= 0.5 * noise]
            found.append(float(heard[-1]) if len(heard) else 0.0)
        return max(*found, 2.0 / (len(prepared.record) * step))

    def moved(self, prepared: PreparedRecord) -> Array:
        """Smoothed position, velocity and acceleration (n_joints, n_steps, 3) at the middle of every step."""
        if prepared not in self._moved:
            clock = clock_of(prepared.record, settings=self.settings.articulated)
            self._moved[prepared] = np.stack([clock.between(part) for part in prepared.motion[:3]], axis=-1)
        return self._moved[prepared]

    @cached_property
    def levels(self) -> tuple[_Level, ...]:
        """What noise leaves, record by record."""
        out = []
        for n, prepared in zip(self.intervals, self.records, strict=True):
            how = self.settings.articulated
            clock = clock_of(prepared.record, settings=how)
            rng = np.random.default_rng(NoiseSettings().seed)
            velocity = draw(self.model, prepared.motion, clock, rng).motion[1]
            pushed = np.std(velocity[n:] - velocity[:-n], axis=0) / (n * prepared.record.step)
            torque = [
                np.hypot(float(np.mean(one.inertia)) * pushed[j], one.process / np.sqrt(n))
                for j, one in enumerate(prepared.joints)
            ]
            speed = how.judgement.sure * np.std(velocity, axis=0)
            out.append(_Level(np.maximum(torque, 1e-12), speed))
        return tuple(out)

    def missing(
        self, j: int, hypothesis: JointHypothesis, vector: Array, r: int, prepared: PreparedRecord
    ) -> Array:
        """Mean torque (n_intervals,) that joint `j` misses in record `r`, whose encoders are as `prepared` has them."""
        record = prepared.joints[j]
        p, numbers = self.parameters(j, hypothesis, vector)
        p[Slot.RATIO] *= record.servo_ratio
        stated = base_slots(self.joints[j], record.on_link)
        # a drive that gives a part of what was logged is off by as much of what was logged
        part = p[Slot.GEAR] * p[Slot.KP] / (stated[Slot.GEAR] * stated[Slot.KP])
        bias, inertia = record.coefficients(numbers)
        motion, still = self.moved(prepared)[j], self.levels[r].speed[j]
        torque = missing_torque(
            p, (inertia, bias, record.load(bias, inertia, p)), record.servo_command, record.step, motion, still,
            self.beside(j, hypothesis, record), self.touch(j, hypothesis, record),
        )  # fmt: skip
        return self.means(r, torque) / part

    def means(self, r: int, samples: Array) -> Array:
        """Means (n_intervals,) of what is known at the steps (n_steps,) of record `r`."""
        steps = self.intervals[r] * self.records[r].joints[0].n_sub
        return np.asarray(samples[: len(samples) // steps * steps].reshape(-1, steps).mean(axis=1))

    def logged(self, j: int, r: int) -> Array:
        """Mean torque (n_intervals,) of the drive of joint `j` in record `r`, by its logged input."""
        prepared, drive = self.records[r], self.joints[j].drive
        assert drive is not None
        position, velocity, _ = self.moved(prepared)[j].T
        return self.means(r, drive.torque(prepared.joints[j].command, position, velocity))

    def residuals(self, j: int, hypothesis: JointHypothesis, vector: Array, part: slice = ALL) -> list[Array]:
        """Missing torque (n_intervals, 1) of joint `j` over that of noise, in every record."""
        return [
            self.missing(j, hypothesis, vector, r, prepared)[:, None] / self.levels[r].torque[j]
            for r, prepared in list(enumerate(self.motions(hypothesis, vector)))[part]
        ]

    def residual(self, j: int, hypothesis: JointHypothesis, vector: Array, part: slice = ALL) -> Array:
        """All records in one (n,)."""
        return np.concatenate([r.ravel() for r in self.residuals(j, hypothesis, vector, part)])

    @cached_property
    def octaves(self) -> Octaves:
        """One band of all frequencies."""
        counts = [(len(p.record) - 1) // n for n, p in zip(self.intervals, self.records, strict=True)]
        most = self.settings.likelihood.error.samples
        samples = sum(min(float(most), n / 2.0**k) for n in counts for k in range(1, n.bit_length() + 1))
        n, n_joints = sum(counts), len(self.joints)
        count = np.full((n_joints, 1), float(n))
        chance = 1.0 + self.settings.articulated.judgement.sure * np.sqrt(2.0 / count)
        return Octaves((np.zeros(n, dtype=np.int64),) * n_joints, count, samples, chance)


def along_motion(candidates: Sequence[PlacedOnJoint]) -> list[PlacedOnJoint]:
    """Candidates that a missing torque can tell of: forces, numbers and inputs that act late; not what takes torque away from its drive,
    nor elastic drives."""
    return [c for c in candidates if not (c.effect.train or c.effect.weakens)]
