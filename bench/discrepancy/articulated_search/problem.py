"""The statistical problem of an articulated model: whitened innovations of every joint, priors, and their derivatives.

The vector of a hypothesis holds the deviations of the nominal parameters in units of their standard uncertainty, then the parameters of its
effects. Shared by joints are the numbers of bodies and what parts of one type have in common; whatever else sits at one joint or drive
changes that joint's runs alone.

What a wrong model leaves is larger than the noise, differs from joint to joint, and lies where the robot moves, at low frequencies. Its
scale in every octave is a parameter too, with the stated noise as its lower bound (`bench.discrepancy.articulated_search.misfit`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import NDArray

from bench.arrays import Array
from bench.discrepancy.articulated_effects.effect import JointScales
from bench.discrepancy.articulated_effects.hypothesis import JointHypothesis, placed_values
from bench.discrepancy.articulated_search.innovations import UnknownStart, softened, whitened
from bench.discrepancy.articulated_search.misfit import Octaves, log_likelihood, transformed
from bench.discrepancy.case.case import Case, CaseRecord
from bench.discrepancy.multibody.body_numbers import BodyNumbers
from bench.discrepancy.multibody.encoders import Encoder
from bench.discrepancy.multibody.joint_forces import Slot
from bench.discrepancy.multibody.joint_record import JointRecord
from bench.discrepancy.multibody.joint_run import predict
from bench.discrepancy.multibody.joints import Joint
from bench.discrepancy.multibody.model import ArticulatedModel
from bench.discrepancy.multibody.nominal_parameters import Nominal, base_slots, move, nominal_parameters
from bench.discrepancy.multibody.records import PreparedRecord, corrected, prepare, settled
from bench.discrepancy.numerics.deadline import NEVER, Deadline
from bench.discrepancy.numerics.made_once import MadeOnce
from bench.discrepancy.settings import DEFAULT, DiagnosisSettings

ALL = slice(None)


@dataclass(eq=False)
class ArticulatedProblem:
    """Records, model and priors.

    Attributes:
        case: The case.
        model: The model at its nominal parameters.
        records: Prepared records.
        settings: Thresholds of the diagnosis.
        deadline: When nothing further is screened or fitted, and fits end where they are.
        softness: Noise of the torque that is assumed beyond what is stated, see `softened`.
        reach: How far nominal parameters go from what was stated, in stated standard uncertainties.
        nominal: Uncertain nominal parameters: those of bodies first, then joint by joint.
    """

    case: Case
    model: ArticulatedModel
    records: tuple[PreparedRecord, ...]
    settings: DiagnosisSettings = DEFAULT
    deadline: Deadline = NEVER
    softness: float = 0.0
    reach: float = np.inf
    nominal: tuple[Nominal, ...] = field(init=False)
    _corrected: MadeOnce[PreparedRecord] = field(init=False)
    _starts: MadeOnce[UnknownStart] = field(init=False)

    def __post_init__(self) -> None:
        self.nominal = nominal_parameters(self.case, self.model)
        self._corrected = MadeOnce(self.settings.articulated.kept_motions * len(self.records))
        self._starts = MadeOnce(len(self.joints) * len(self.records))

    @classmethod
    def of(
        cls,
        case: Case,
        model: ArticulatedModel,
        records: Sequence[CaseRecord],
        settings: DiagnosisSettings = DEFAULT,
        deadline: Deadline = NEVER,
    ) -> Self:
        """Prepare records."""
        prepared = tuple(prepare(case, model, record, settings=settings) for record in records)
        return cls(case, model, prepared, settings, deadline)

    @property
    def joints(self) -> tuple[Joint, ...]:
        """The joints."""
        return self.model.joints

    @cached_property
    def shared(self) -> tuple[int, ...]:
        """Indices of the nominal parameters that joints share."""
        return tuple(i for i, p in enumerate(self.nominal) if p.shared)

    @cached_property
    def felt(self) -> tuple[tuple[int, ...], ...]:
        """Of those, (n_joints,) the ones that the runs of each joint feel: a joint does not move the bodies that carry it."""

        def feels(j: int, entry: Nominal) -> bool:
            if not entry.of_body:
                return j in entry.joints
            return any(record.joints[j].bodies[entry.target].felt for record in self.records)

        return tuple(
            tuple(i for i in self.shared if feels(j, self.nominal[i])) for j in range(len(self.joints))
        )

    def locals(self, j: int) -> tuple[int, ...]:
        """Indices of the nominal parameters of joint `j` alone."""
        return self._locals[j]

    @cached_property
    def _locals(self) -> tuple[tuple[int, ...], ...]:
        own = [None if p.shared else p.joints for p in self.nominal]
        return tuple(tuple(i for i, at in enumerate(own) if at == (j,)) for j in range(len(self.joints)))

    def size(self, hypothesis: JointHypothesis) -> int:
        """Length of the vector of a hypothesis."""
        return len(self.nominal) + sum(len(placed.effect.parameters) for placed in hypothesis)

    def etas(self, hypothesis: JointHypothesis, vector: Array) -> list[Array]:
        """The part of a vector that belongs to each effect."""
        out, at = [], len(self.nominal)
        for placed in hypothesis:
            stop = at + len(placed.effect.parameters)
            out.append(vector[at:stop])
            at = stop
        return out

    def reached(self, hypothesis: JointHypothesis) -> tuple[int, ...]:
        """Joints whose runs an effect of a hypothesis changes."""
        out: set[int] = set()
        for placed in hypothesis:
            local = placed.effect.site in ("joint", "pair", "end", "actuator")
            out |= set(placed.joints if local else range(len(self.joints)))
        return tuple(sorted(out))

    def entries(self, j: int, hypothesis: JointHypothesis) -> NDArray[np.int64]:
        """Entries of the vector of a hypothesis on which the runs of joint `j` depend."""
        out, at = [*self.felt[j], *self.locals(j)], len(self.nominal)
        for placed in hypothesis:
            stop = at + len(placed.effect.parameters)
            out += range(at, stop) if j in self.reached((placed,)) else ()
            at = stop
        return np.array(out, dtype=np.int64)

    def motions(self, hypothesis: JointHypothesis, vector: Array) -> tuple[PreparedRecord, ...]:
        """The records, their encoders corrected as a hypothesis has it."""
        wrong: dict[str, Encoder] = {}
        for placed, eta in zip(hypothesis, self.etas(hypothesis, vector), strict=True):
            if placed.effect.encoder is not None:
                name = self.joints[placed.joint].name
                new = placed.effect.encoder(placed.effect.values(eta, placed.scales))
                old = wrong.get(name, Encoder())
                wrong[name] = Encoder(*(a + b for a, b in zip(old, new, strict=True)))
        if not wrong:
            return self.records
        # whether a servo acts on a wrong reading changes its runs and not the motion
        key = tuple(sorted((name, encoder._replace(in_loop=0.0)) for name, encoder in wrong.items()))
        found = self._corrected.get_each(
            [(key, r) for r in range(len(self.records))],
            lambda r: corrected(self.case, self.model, self.records[r], dict(key), settings=self.settings),
        )
        if not any(encoder.in_loop for encoder in wrong.values()):
            return tuple(found)
        return tuple(r.read_by(wrong) for r in found)

    def softened(self, level: float) -> ArticulatedProblem:
        """The same problem with torque noise of at least `level` times the RMS torque where no servo holds a joint.

        A free run that nothing corrects remembers every error of a wrong model to its end: the misfit of an elastic or slipping drive
        has then a minimum at the truth and many beside it. Corrected a little at every sample, it forgets.
        """
        if all(joint.held for joint in self.joints):
            return self
        records = tuple(softened(prepared, level) for prepared in self.records)
        return replace(self, records=records, softness=max(level, self.softness))

    def settled(self, hypothesis: JointHypothesis, vector: Array) -> ArticulatedProblem:
        """The same problem about the postures that a fit has: of links of elastic joints, and behind wrong encoders; else itself."""
        elastic = [
            p.joint for p in hypothesis if p.effect.train and not self.records[0].joints[p.joint].on_link
        ]
        if not elastic and not any(placed.effect.encoder for placed in hypothesis):
            return self
        numbers, records = self.numbers(hypothesis, vector), []
        for raw, prepared in zip(self.records, self.motions(hypothesis, vector), strict=True):
            links = {j: self.innovations(j, hypothesis, vector, prepared)[1][:, 2:] for j in elastic}
            settings = self.settings.articulated
            records.append(settled(self.case, self.model, raw, prepared, links, numbers, settings=settings))
        return replace(self, records=tuple(records))

    def slots(self, j: int, hypothesis: JointHypothesis, vector: Array, *, on_link: bool) -> Array:
        """Parameter vector (SLOTS,) of the runs of joint `j`."""
        joint = self.joints[j]
        p = base_slots(joint, on_link)
        for i in self.locals(j):
            entry = self.nominal[i]
            move(p, entry.kind, entry.factor * entry.deviation(vector, i))
        for placed, eta in zip(hypothesis, self.etas(hypothesis, vector), strict=True):
            if placed.effect.slots is not None and j in placed.joints:
                placed.effect.slots(placed_values(placed, eta), p)
        return p

    def parameters(self, j: int, hypothesis: JointHypothesis, vector: Array) -> tuple[Array, BodyNumbers]:
        """Parameter vector of joint `j`, see `slots`, and the bodies: what is the same in every record."""
        on_link = self.records[0].joints[j].on_link
        return self.slots(j, hypothesis, vector, on_link=on_link), self.numbers(hypothesis, vector)

    def innovations(
        self, j: int, hypothesis: JointHypothesis, vector: Array, prepared: PreparedRecord
    ) -> tuple[Array, Array]:
        """Innovations (n, n_measured) and states (n, 4), see `joint_run.run`, of joint `j` in a record; NaN where it diverged."""
        record = prepared.joints[j]
        out, states = self.run(j, hypothesis, vector, record, record.gain, record.start, None)
        return out[:, : record.n_measured], states

    def run(
        self,
        j: int,
        hypothesis: JointHypothesis,
        vector: Array,
        record: JointRecord,
        gain: Array,
        starts: Array,
        every: int | None,
        known: tuple[Array, BodyNumbers] | None = None,
    ) -> tuple[Array, Array]:
        """Innovations (n, 2) and states (n, 4) of joint `j` from `starts`, set anew after `every` samples, see `joint_run.predict`; `known`
        as of `parameters`."""
        stated, numbers = known or self.parameters(j, hypothesis, vector)
        (bias, inertia), p = record.coefficients(numbers), stated.copy()
        p[Slot.RATIO] *= record.servo_ratio
        return predict(
            p, (inertia, bias, record.slope, record.reference, record.load(bias, inertia, p)), record.servo_command, record.step,
            record.n_sub, (record.position, record.velocity), gain, starts, every, self.beside(j, hypothesis, record),
            self.touch(j, hypothesis, record),
        )  # fmt: skip

    def beside(self, j: int, hypothesis: JointHypothesis, record: JointRecord) -> Array | None:
        """Velocity (n_steps,) of the neighbour with which joint `j` shares a drive in a hypothesis, if it does."""
        for placed in hypothesis:
            if placed.partner is not None and j in placed.joints:
                (other,) = (i for i in placed.joints if i != j)
                return record.beside[self.joints[other].name]
        return None

    def touch(self, j: int, hypothesis: JointHypothesis, record: JointRecord) -> Array | None:
        """Lowest point (3, n_steps) of the end of the tree that touches a surface in a hypothesis, as joint `j` moves it, if it does."""
        end = next((p.where for p in hypothesis if p.effect.site == "end" and j in p.joints), None)
        return None if end is None else record.touches[end]

    def numbers(self, hypothesis: JointHypothesis, vector: Array) -> BodyNumbers:
        """The bodies as a hypothesis has them."""
        changed: dict[str, dict[str, float]] = {}
        for i in self._bodily:
            if vector[i] != 0.0:
                entry = self.nominal[i]
                changed.setdefault(entry.target, {})[entry.kind] = entry.deviation(vector, i)
        placed = zip(hypothesis, self.etas(hypothesis, vector), strict=True)
        missing = [(p.where, p.effect.values(eta, p.scales)) for p, eta in placed if p.effect.bodily]
        return BodyNumbers(changed, missing)

    @cached_property
    def _bodily(self) -> tuple[int, ...]:
        """Indices of the nominal parameters of bodies."""
        return tuple(i for i, p in enumerate(self.nominal) if p.of_body)

    def residuals(self, j: int, hypothesis: JointHypothesis, vector: Array, part: slice = ALL) -> list[Array]:
        """Whitened, weighted innovations (n, n_measured) of joint `j` in every record, less what its unknown start makes of them."""
        most, found = self.settings.articulated.diverged, []
        known, motions = self.parameters(j, hypothesis, vector), self.motions(hypothesis, vector)
        for original, prepared in zip(self.records[part], motions[part], strict=True):
            record = prepared.joints[j]
            out, _ = self.run(j, hypothesis, vector, record, record.gain, record.start, None, known)
            found.append(self.start(j, original).taken_out(whitened(original.joints[j], record, out, most)))
        return found

    def start(self, j: int, prepared: PreparedRecord) -> UnknownStart:
        """What is not known of the start of joint `j` in a record, as the nominal model carries it along."""
        record, vector = prepared.joints[j], np.zeros(len(self.nominal))

        def from_there(start: Array) -> Array:
            out, _ = self.run(j, (), vector, record, record.gain, start, None)
            return whitened(record, record, out, self.settings.articulated.diverged)

        return self._starts.get((j, id(prepared)), lambda: UnknownStart.of(record, from_there))

    def log_likelihood(self, power: Array) -> float:
        """Log-likelihood of the logs up to a constant that no softness changes, from the (n_joints, n_octaves) sums of squares of a fit."""
        unknown = sum(self.start(j, r).log_determinant for r in self.records for j in range(len(self.joints)))
        return log_likelihood(self.records, self.octaves, power) - unknown

    def residual(self, j: int, hypothesis: JointHypothesis, vector: Array, part: slice = ALL) -> Array:
        """Their cosine transforms, all records in one (n,); the squares of an octave sum to about its count where nothing is missing."""
        return transformed(self.residuals(j, hypothesis, vector, part))

    @cached_property
    def octaves(self) -> Octaves:
        """The octaves of the residuals, in which what is left is weighed."""
        return Octaves.of(self.records, self.settings)

    def prior(self, hypothesis: JointHypothesis) -> tuple[Array, Array, Array, Array]:
        """Mean, standard deviation, lower and upper bound of a vector."""
        n = len(self.nominal)
        mean, std = [np.zeros(n)], [np.ones(n)]
        lows = [np.array([max(p.lowest, -self.reach) for p in self.nominal])]
        highs = [np.full(n, self.reach)]
        for placed in hypothesis:
            p = placed.effect.parameters
            mean.append(np.array([x.mean for x in p]))
            std.append(np.array([x.std for x in p]))
            lows.append(np.array([x.bounds[0] for x in p]))
            highs.append(np.array([x.bounds[1] for x in p]))
        return np.concatenate(mean), np.concatenate(std), np.concatenate(lows), np.concatenate(highs)

    def scales(self, j: int) -> JointScales:
        """Scales of joint `j` over all records."""
        joint = self.joints[j]
        drive = joint.drive
        assert drive is not None
        torques, inputs, q, v = [], [], [], []
        for prepared in self.records:
            record = prepared.joints[j]
            inputs.append(record.command - drive.gear * record.reference if drive.servo else record.command)
            speed = np.gradient(record.reference, record.step)
            torques.append(drive.torque(record.command, record.reference, speed))
            q.append(prepared.motion.position[:, j])
            v.append(prepared.motion.velocity[:, j])
        q_all, v_all = np.concatenate(q), np.concatenate(v)
        torque = np.concatenate(torques)
        middle = 0.5 * float(q_all.max() + q_all.min())
        return JointScales(
            float(np.sqrt(np.mean(torque**2))) or 1.0,
            float(np.abs(torque).max()) / (abs(drive.gear) or 1.0) or 1.0,
            0.5 * float(np.ptp(q_all)) or 1.0,
            float(np.abs(v_all).max()) or 1.0,
            float(np.mean(self.records[0].joints[j].inertia)),
            float(np.sqrt(np.mean(np.concatenate(inputs) ** 2))) or 1.0,
            self.model.mass(joint.body) or 1.0,
            float(np.linalg.norm(self.model.tips[joint.body])) or 1.0,
            middle,
            drive.strongest if np.isfinite(drive.strongest) else float(np.abs(torque).max()) or 1.0,
        )
