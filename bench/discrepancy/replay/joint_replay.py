"""Judging records of an articulated case run in the user's own model: one joint free at a time, as its verdict judges, or all at once.

Joints that are not free follow the measured motion (`replay.as_measured`). All of it is plain MuJoCo.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field

import mujoco
import numpy as np

from bench.arrays import Array
from bench.discrepancy.application.applying import Applied, Findings
from bench.discrepancy.application.forces import values_of
from bench.discrepancy.application.target import PREFIX
from bench.discrepancy.articulated_effects.catalogue import CATALOGUE
from bench.discrepancy.case.case import Case, CaseRecord
from bench.discrepancy.multibody.channels import bound
from bench.discrepancy.multibody.encoders import Encoder, travel
from bench.discrepancy.multibody.inputs import inputs_of
from bench.discrepancy.multibody.joint_record import judged_from, window_of
from bench.discrepancy.multibody.joints import Joint
from bench.discrepancy.multibody.model import ArticulatedModel
from bench.discrepancy.multibody.motion import JointMotion, motion_of
from bench.discrepancy.numerics.threads import in_threads
from bench.discrepancy.replay.as_measured import Followed, followed, held, holder
from bench.discrepancy.replay.running import Reading, Stretch, Train, controls, coordinate_at, hook_of, run
from bench.discrepancy.replay.wound_trains import Wound, wound_trains
from bench.discrepancy.settings import DEFAULT
from bench.discrepancy.verdict import NamedEffect
from bench.rig.held_joints import followed as followed_joints


@dataclass(frozen=True)
class JointReplaySettings:
    """Numbers of `bench.discrepancy.replay.joint_replay`."""

    far_off: float = 1e3
    """Error that stands for a run that diverged."""


SETTINGS = JointReplaySettings()


@dataclass(frozen=True, eq=False)
class JointReplay:
    """The judging records of a case.

    Attributes:
        case: The case, its channels bound to joints and actuators.
        model: The nominal model.
        wound: How far trains are wound up where windows begin, as far as it is known.
    """

    case: Case
    model: ArticulatedModel
    wound: Wound = field(default_factory=Wound)

    @classmethod
    def of(cls, case: Case, nominal: mujoco.MjModel, findings: Findings | None = None) -> JointReplay:
        """Prepare the replay of a case in its model, joints that it has held welded, with what was found in it."""
        own, model = bound(case, nominal), ArticulatedModel.of(nominal, case.rig)
        return cls(own, model, wound_trains(own, model, findings) if findings else Wound())

    @property
    def driven(self) -> tuple[Joint, ...]:
        """Joints but those that the case has move as measured, whatever moves them."""
        tied = followed_joints(self.case.options.get("joints"))
        return tuple(joint for joint in self.model.joints if joint.name not in tied)

    def readings(
        self,
        applied: Applied,
        effects: Sequence[NamedEffect],
        only: Collection[str] = (),
        *,
        together: bool = False,
    ) -> dict[str, list[Reading]]:
        """Position of every joint in every judging record, measured and simulated.

        Args:
            applied: The model they are run with.
            effects: Logs of wrong encoders are corrected first; what is simulated is the log.
            only: Joints; all of them where none is named, but those that move as measured whatever moves them.
            together: Whether they are free at once, as where the model is used, rather than each beside the measured motion of the others.
        """
        wrong = encoders_wrong(effects)
        raw = [
            motion_of(self.case, self.model, record, {}, settings=DEFAULT.motion)
            for record in self.case.validation
        ]
        motions = [
            motion_of(self.case, self.model, record, wrong, like, settings=DEFAULT.motion) if wrong else like
            for record, like in zip(self.case.validation, raw, strict=True)
        ]
        applied = applied.as_tested(self.case)
        reference = applied.compiled()
        judged = only or [joint.name for joint in self.driven]
        asked = [j for j, joint in enumerate(self.model.joints) if joint.name in judged]

        def read(free: Sequence[int]) -> dict[str, list[Reading]]:
            names = [self.model.joints[j].name for j in free]
            model = held(applied, names, reference, [tie.name for tie in self.model.ties])
            out: dict[str, list[Reading]] = {name: [] for name in names}
            for r, (record, motion, logged) in enumerate(
                zip(self.case.validation, motions, raw, strict=True)
            ):
                wound = {name: states[r] for name, states in self.wound.items()}
                errors = self._errors(applied, model, free, record, motion, wrong, wound)
                for j, name, error in zip(free, names, errors, strict=True):
                    noise = max(float(np.max(one.noise[j])) for one in raw)
                    factor, measured = 1.0 + wrong.get(name, Encoder()).gain, logged.samples[j][:, 0]
                    size, first = travel(self.case, self.model.joints[j], noise), self._window(free, record)
                    out[name].append(
                        Reading(measured, measured - factor * error, size, judged_from(first, len(record)))
                    )
            return out

        found = in_threads(read, [asked] if together else [[j] for j in asked])
        return {name: read for one in found for name, read in one.items()}

    def errors(
        self,
        applied: Applied,
        effects: Sequence[NamedEffect],
        only: Collection[str] = (),
        *,
        together: bool = False,
    ) -> dict[str, Array]:
        """Simulated less measured positions over the travel of the joint, by joint, all judging records in a row; arguments as above."""
        far = SETTINGS.far_off
        return {
            name: np.clip(
                np.nan_to_num(
                    np.concatenate([r.error for r in found]),
                    nan=far, posinf=far, neginf=-far,
                ),
                -far, far,
            )
            for name, found in self.readings(applied, effects, only, together=together).items()
        }  # fmt: skip

    def _window(self, free: Sequence[int], record: CaseRecord) -> int:
        """Samples of a run of some joints: the least of theirs, zero where servos hold them all."""
        return min(filter(None, (window_of(self.model.joints[j], record.step) for j in free)), default=0)

    def _errors(
        self,
        applied: Applied,
        model: mujoco.MjModel,
        free: Sequence[int],
        record: CaseRecord,
        motion: JointMotion,
        wrong: Mapping[str, Encoder],
        wound: Mapping[str, Array],
    ) -> list[Array]:
        """Measured less simulated positions (n,) of joints that are free at once."""
        names, step = [self.model.joints[j].name for j in free], float(model.opt.timestep)
        every = self._window(free, record) or len(record)
        steps = int(np.ceil((len(record) - 1) * record.step / step - 1e-9)) + 1
        # one joint alone keeps the clock of its log, several that of their inputs
        delays = [wrong.get(name, Encoder()).delay for name in names]
        late = delays[0] if len(free) == 1 else 0.0
        columns = self._columns(record, names[0], late)
        control = controls(record, columns, model, steps, self.case.load_interpolation)
        follow = followed(self.model.joints, motion, record, model, steps, late)
        for i, other in enumerate(self.model.joints):
            if i not in free:
                control[:, model.actuator(holder(other.name)).id] = follow.command[:, i]
        firsts = list(range(0, len(record), every))
        begins = [int(np.floor(first * record.step / step + 1e-6)) for first in firsts]
        trains = _trains(applied, model, self.model.joints, names)
        windows = [
            _wound_as(self._start(trains, model, motion, first, follow, b), trains, wound, first)
            for first, b in zip(firsts, begins, strict=True)
        ]
        length = int(np.ceil(min(every, len(record)) * record.step / step - 1e-9)) + 1
        position, velocity = run(
            model,
            hook_of(applied),
            windows,
            control,
            length,
            rested=False,
            trains=[train for train in trains if train.joint not in wound],
        )

        def error(j: int, name: str, delay: float) -> Array:
            reading, out = self._reading(applied, model, name), np.empty(len(record))
            # a log that is later than the run shows the end of the window before at the beginning of the next
            seen = np.maximum(np.arange(len(record)) * record.step - (delay - late), 0.0)
            window = (seen / record.step + 1e-9).astype(np.int64) // every
            for w, begin in enumerate(begins):
                times = seen[window == w] - begin * step
                out[window == w] = coordinate_at(position[w] @ reading, velocity[w] @ reading, step, times)
            return np.asarray(motion.samples[j][:, 0] - out, dtype=np.float64)

        return [error(*one) for one in zip(free, names, delays, strict=True)]

    def _columns(self, record: CaseRecord, joint: str, late: float) -> dict[str, Array]:
        clock = np.arange(len(record)) * record.step
        columns = {}
        for other in self.driven:
            for name, samples in inputs_of(self.case, other, record).items():
                shifted = late and other.name == joint
                columns[name] = np.interp(clock - late, clock, samples) if shifted else samples
        return columns

    def _reading(self, applied: Applied, model: mujoco.MjModel, joint: str) -> Array:
        """Row (nq,) of the joint's encoder."""
        row = np.zeros(model.nq)
        row[model.joint(joint).qposadr[0]] = 1.0
        if joint in applied.outputs:
            row[model.joint(f"{PREFIX}{joint}_train").qposadr[0]] = 1.0
        return row

    def _start(
        self,
        trains: Sequence[Train],
        model: mujoco.MjModel,
        motion: JointMotion,
        first: int,
        follow: Followed,
        begin: int,
    ) -> Stretch:
        """State at the first sample of a window: as measured; trains wound up by what their links weigh."""
        data = mujoco.MjData(model)
        for i, joint in enumerate(self.model.joints):
            own = model.joint(joint.name)
            here = begin < len(follow.position)
            data.qpos[own.qposadr[0]] = follow.position[begin, i] if here else motion.position[first, i]
            data.qvel[own.dofadr[0]] = follow.velocity[begin, i] if here else motion.velocity[first, i]
        for tie in self.model.ties:
            to, moved = model.joint(tie.to), model.joint(tie.name)
            data.qpos[moved.qposadr[0]] = tie.offset + tie.ratio * data.qpos[to.qposadr[0]]
            data.qvel[moved.dofadr[0]] = tie.ratio * data.qvel[to.dofadr[0]]
        if trains:
            mujoco.mj_forward(model, data)
        for train in trains:
            train.wind(data.qpos, data.qvel, -_wound(model, train, float(data.qfrc_bias[train.dof])), 0.0)
        return Stretch(begin, np.array(data.qpos), np.array(data.qvel))


def _trains(
    applied: Applied, model: mujoco.MjModel, joints: Sequence[Joint], free: Collection[str]
) -> list[Train]:
    """Trains that move freely: of the free joints, and of those whose motor follows what its encoder measured."""
    out = []
    for joint in joints:
        train = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, f"{PREFIX}{joint.name}_train")
        on_link = joint.name in applied.outputs
        if train >= 0 and (joint.name in free or not on_link):
            own = model.joint(joint.name)
            motor = (int(own.qposadr[0]), int(own.dofadr[0])) if on_link else None
            out.append(Train(int(model.jnt_qposadr[train]), int(model.jnt_dofadr[train]), motor, joint.name))
    return out


def _wound_as(start: Stretch, trains: Sequence[Train], wound: Mapping[str, Array], first: int) -> Stretch:
    """A start of a window at sample `first`, its trains wound up as far as is known."""
    for train in trains:
        if train.joint in wound:
            train.wind(start.position, start.velocity, *wound[train.joint][first])
    return start


def _wound(model: mujoco.MjModel, train: Train, weight: float) -> float:
    """Deflection of a train under a torque."""
    joint = int(model.dof_jntid[train.dof])
    stiffness = float(np.ravel(model.jnt_stiffness[joint])[0])
    if stiffness > 0.0:
        return weight / stiffness
    if not model.jnt_limited[joint]:
        return 0.0
    contact = -float(model.jnt_solref[joint, 0]) / float(model.dof_invweight0[train.dof])
    return weight / max(contact, 1e-300) + float(np.copysign(model.jnt_range[joint, 1], weight))


def encoders_wrong(effects: Sequence[NamedEffect]) -> dict[str, Encoder]:
    """Joint to what is wrong with its log."""
    known = {entry.name: entry for entry in CATALOGUE}
    out: dict[str, Encoder] = {}
    for effect in effects:
        entry = known.get(effect.name)
        if entry is not None and entry.encoder is not None:
            name = effect.where or effect.channel
            new, old = entry.encoder(values_of(effect)), out.get(name, Encoder())
            out[name] = Encoder(*(a + b for a, b in zip(old, new, strict=True)))
    return out
