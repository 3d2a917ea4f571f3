"""Records of a rehearsal: the user's own model with an effect put in, run in plain MuJoCo with the planned signals, with the stated noise.

The model is converged: a fine step, Runge-Kutta, dry friction as hard as the step lets it be. That is not how the fits integrate, so that a
right answer is no agreement of one code with itself. What a nominal parameter really is is drawn from its stated uncertainty.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import mujoco
import numpy as np

from bench import native
from bench.arrays import Array
from bench.discrepancy.application.applying import Applied, Findings, RunOptions, apply, specification
from bench.discrepancy.application.target import PREFIX
from bench.discrepancy.articulated.recognition import applies
from bench.discrepancy.case.case import Case, CaseChannel, CaseRecord
from bench.discrepancy.model.rigs import structure_of
from bench.discrepancy.multibody.channels import bound
from bench.discrepancy.multibody.encoders import TRUE, Encoder, encoders_of
from bench.discrepancy.multibody.inputs import inputs_of
from bench.discrepancy.multibody.model import ArticulatedModel
from bench.discrepancy.replay.joint_replay import encoders_wrong
from bench.discrepancy.replay.linear_replay import LinearReplay
from bench.discrepancy.replay.running import Stretch, controls, hook_of, run, sampled
from bench.discrepancy.replay.verification import VerificationSettings
from bench.discrepancy.verdict import NamedEffect, NominalEstimate
from bench.errors import ModelError, ParameterError, SimulationError

Readings = Callable[[Applied, Sequence[NamedEffect], CaseRecord], Mapping[str, Array]]


@dataclass(frozen=True)
class TruthSettings:
    """Numbers of `bench.discrepancy.rehearsal.truth`."""

    within: float = 2.0
    """Stated uncertainties within which nominal parameters are drawn: 95 % of a normal distribution."""
    settling: float = 3.0
    """Seconds for which servos hold their first target before a record: several time constants of a drive."""


SETTINGS = TruthSettings()


@dataclass(frozen=True, eq=False)
class ModelLaboratory:
    """A laboratory in which the user's model is the machine.

    Attributes:
        case: Nominal model, channels and the records whose commands are played.
        path: The model.
        readings: What the channels read when a model plays a record.
        articulated: Whether it is a case for the engine of articulated models.
    """

    case: Case
    path: Path
    readings: Readings
    articulated: bool

    @classmethod
    def of(cls, case: Case) -> ModelLaboratory:
        """The laboratory of a case.

        Raises:
            ModelError: Its rig is no MJCF.
            ParameterError: The noise of a response is not stated.
        """
        if not case.rig.endswith(".xml"):
            raise ModelError(
                f"the case has the rig '{case.rig}' of the bench; a rehearsal needs a model of your own, as an MJCF"
            )
        for channel in case.channels:
            if channel.role == "response" and channel.noise_std is None and not channel.resolution:
                raise ParameterError(
                    f"nothing states the noise of '{channel.name}'; give its noise_std in nominal.json, as it will be on the day"
                )
        path = Path(case.folder or ".") / case.rig
        articulated = applies(case)
        case = replace(
            case,
            identification=tuple(replace(r, at_rest=True) for r in case.identification),
            validation=tuple(replace(r, at_rest=True) for r in case.validation),
        )
        if articulated:
            nominal = specification(path).compile()
            of_joints = _OfJoints(bound(case, nominal), ArticulatedModel.of(nominal, case.rig))
            return cls(case, path, of_joints.readings, articulated)
        # a free run from rest, however far it drifts: this is what a machine does
        return cls(case, path, LinearReplay(case, structure_of(case), windowed=False).sensed, articulated)

    @native.quiet()
    def measured(self, findings: Findings, rng: np.random.Generator, *, noisy: bool = True) -> Case:
        """The case with the records of the model with something put in.

        Args:
            findings: Effects and true values of parameters.
            rng: Of the noise.
            noisy: Whether there is any.

        Raises:
            ModelError: The model cannot hold an effect.
            SimulationError: It leaves all bounds.
        """
        settings = VerificationSettings()
        step = float(specification(self.path).option.timestep) / settings.converged
        fine = RunOptions(step, mujoco.mjtIntegrator.mjINT_RK4, hard=True)
        applied = apply(self.path, findings, case=self.case, linear=not self.articulated, options=fine)
        for change in applied.changes:
            if change.form == "none":
                raise ModelError(f"{change.what} cannot be put into the model: {change.text}")

        def record(planned: CaseRecord) -> CaseRecord:
            return self._record(applied, findings.effects, planned, rng if noisy else None)

        return replace(
            self.case,
            identification=tuple(map(record, self.case.identification)),
            validation=tuple(map(record, self.case.validation)),
        )

    @native.quiet()
    def played(self, commands: Mapping[str, Array]) -> Case:
        """The case with one record of the nominal model, as its user runs it and without noise, for commands (n,) by channel.

        Raises:
            SimulationError: It leaves all bounds.
        """
        applied = apply(self.path, Findings(()), case=self.case, linear=not self.articulated)
        planned = self.case.identification[0]
        planned = replace(planned, values={**planned.values, **commands})
        return replace(self.case, identification=(self._record(applied, (), planned, None),), validation=())

    def logged(self, record: CaseRecord, rng: np.random.Generator) -> CaseRecord:
        """A record with the noise of its channels."""
        values = {c.name: _logged(np.asarray(record.values[c.name]), c, rng) for c in self.case.channels}
        return replace(record, values=values)

    def logged_case(self, case: Case, rng: np.random.Generator) -> Case:
        """A case with the noise of its channels in every record."""
        return replace(
            case,
            identification=tuple(self.logged(record, rng) for record in case.identification),
            validation=tuple(self.logged(record, rng) for record in case.validation),
        )

    def _record(
        self,
        applied: Applied,
        effects: Sequence[NamedEffect],
        planned: CaseRecord,
        rng: np.random.Generator | None,
    ) -> CaseRecord:
        values = {name: np.asarray(samples) for name, samples in planned.values.items()}
        values |= self.readings(applied, effects, planned)
        for channel in self.case.channels:
            bad = np.flatnonzero(~np.isfinite(values[channel.name]))
            if len(bad):
                put_in = ", ".join(effect.name for effect in effects) or "nothing put in"
                raise SimulationError(
                    f"the model leaves all bounds in '{planned.name}' with {put_in}; play weaker signals",
                    time=float(planned.time[max(int(bad[0]) - 1, 0)]),
                )
        out = replace(planned, values=values, notes=(), bridged=())
        return out if rng is None else self.logged(out, rng)

    def drawn(self, rng: np.random.Generator) -> tuple[NominalEstimate, ...]:
        """True values of the nominal parameters, within their stated uncertainties."""
        out = []
        for p in self.case.parameters:
            if p.std <= 0.0:
                continue
            off = float(np.clip(rng.standard_normal(), -SETTINGS.within, SETTINGS.within))
            true = p.value * p.factor**off if p.factor > 1.0 else max(p.value + off * p.std, 0.05 * p.value)
            out.append(NominalEstimate(p.name, true, 0.0, p.value, p.std, off))
        return tuple(out)


def _logged(samples: Array, channel: CaseChannel, rng: np.random.Generator) -> Array:
    """Samples as the logger writes them: with noise, in steps of the encoder."""
    out = samples + (channel.noise_std or 0.0) * rng.standard_normal(len(samples))
    return np.round(out / channel.resolution) * channel.resolution if channel.resolution else out


@dataclass(frozen=True, eq=False)
class _OfJoints:
    """Readings of an articulated model, all of its joints free.

    Attributes:
        case: The case, its channels bound to joints and actuators.
        model: The nominal model.
    """

    case: Case
    model: ArticulatedModel

    def readings(
        self, applied: Applied, effects: Sequence[NamedEffect], record: CaseRecord
    ) -> Mapping[str, Array]:
        compiled = applied.compiled()
        step = float(compiled.opt.timestep)
        servos = all(joint.held for joint in self.model.joints)
        settling = round(SETTINGS.settling / step) if servos else 0
        steps = int(np.ceil((len(record) - 1) * record.step / step - 1e-9)) + 1
        columns = {
            name: samples
            for joint in self.model.joints
            for name, samples in inputs_of(self.case, joint, record).items()
        }
        played = controls(record, columns, compiled, steps, self.case.load_interpolation)
        control = np.vstack([np.repeat(played[:1], settling, axis=0), played])
        start = Stretch(0, np.array(compiled.qpos0), np.zeros(compiled.nv))
        position, velocity = run(compiled, hook_of(applied), [start], control, len(control), rested=False)
        times = np.asarray(np.arange(len(record)) * record.step, dtype=np.float64)
        motion = sampled(position[0, settling:], velocity[0, settling:], compiled, times)
        wrong = encoders_wrong(effects)
        out = {}
        for joint in self.model.joints:
            rows = [joint.name, *([f"{PREFIX}{joint.name}_train"] if joint.name in applied.outputs else [])]
            q = sum(motion.position[:, compiled.joint(row).qposadr[0]] for row in rows)
            v = sum(motion.velocity[:, compiled.joint(row).dofadr[0]] for row in rows)
            encoders = encoders_of(self.case, joint)
            for channel, order in zip(encoders.channels, encoders.orders, strict=True):
                encoder = wrong.get(joint.name, TRUE)
                out[channel.name] = _read(np.asarray((q, v)[order]), order, encoder, times)
        return out


def _read(samples: Array, order: int, encoder: Encoder, times: Array) -> Array:
    """What an encoder that may be wrong reads."""
    late = np.interp(times - encoder.delay, times, samples) if encoder.delay else samples
    if order == 1:
        return (1.0 + encoder.speed) * late
    return (1.0 + encoder.gain) * late + encoder.offset
