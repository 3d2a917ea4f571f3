"""Records of an articulated model, prepared: for every joint the coefficients of its equation along the measured motion, and its noise.

The motion is smoothed from the encoders (`kalman_smoother`). Where an encoder is wrong, its log is corrected first (`Encoder`), and all
follows from the corrected one, since a posture that is wrong at one joint is felt by all.

The gain of the innovations is the stationary Kalman gain of the joint about its mean inertia. Its process noise is the stated noise of the
measured torque, and what the noise of the other joints' motion makes of the torque of the inverse dynamics; both pass through the
model once, as one draw.
"""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.linalg import expm, solve_discrete_are
from scipy.signal import butter, sosfiltfilt, welch

from bench.discrepancy.case.case import Case, CaseChannel, CaseRecord
from bench.discrepancy.motion.kalman_smoother import Smoother, resting, smoother_of
from bench.discrepancy.multibody.model import ArticulatedModel, Dynamics, Joint
from bench.errors import FileFormatError

Array = NDArray[np.float64]
LONGEST_STEP = 1e-3
"""Longest integration step [s]: MuJoCo's own default is two of them, and a servo of 10 Hz is then integrated to 3e-4."""
ORDERS = {"position": 0, "velocity": 1}
NOISE_SEED = 0
"""Seed of the draw of the noise of the motion, so that a diagnosis repeats exactly."""
SERVO_BAND = (0.2, 10.0)
"""Frequencies [Hz] between which the torque noise that the motion's noise makes is averaged: those that a joint follows."""


class Encoder(NamedTuple):
    """What is wrong with the log of a joint: ``logged = (1 + gain) true(t - delay) + offset``, its velocity ``(1 + speed) true``.

    A servo may act on the wrong reading (``in_loop`` of one), or have a right one of its own (zero).
    """

    offset: float = 0.0
    gain: float = 0.0
    delay: float = 0.0
    speed: float = 0.0
    in_loop: float = 0.0

    def corrected(self, samples: Array, orders: Sequence[int]) -> Array:
        """True samples (n, n_channels) behind logged ones of the given orders (0 position, 1 velocity), the delay left in."""
        out = np.array(samples)
        for c, order in enumerate(orders):
            if order == 0:
                out[:, c] = (out[:, c] - self.offset) / (1.0 + self.gain)
            else:
                out[:, c] /= 1.0 + self.speed
        return out

    def scaled(self, noise: Array, orders: Sequence[int]) -> Array:
        """Noise of the corrected samples."""
        factors = [abs(1.0 + (self.gain if order == 0 else self.speed)) for order in orders]
        return noise / np.array(factors)


TRUE = Encoder()
"""An encoder with nothing wrong."""


@dataclass(frozen=True, eq=False)
class JointRecord:
    """One joint in one record.

    Attributes:
        joint: The joint.
        step: Integration step [s].
        n_sub: Integration steps a sample.
        inertia: (n_steps,) armature included; bias, slope, reference, load likewise, see `joint_run.run`.
        bias: (n_steps,).
        slope: (n_steps,).
        reference: (n_steps,).
        load: (n_steps,) torque that the gear carries.
        command: (n_steps,) input.
        position: (n,) measured.
        velocity: (n,) measured, or (0,).
        noise: (n_measured,).
        start: (2,) smoothed position and velocity at the first sample.
        side: "motor" or "link", where the encoder sits; empty where nobody says.
        process: Equivalent white noise of the torque, one-sigma a sample.
        changes: Body to the changes of bias and inertia (2, n_steps) for a kilogram more of it.
        payloads: The same for a kilogram at its tip.
        centres: The same (3, 2, n_steps) for a metre of its centre of mass along each axis.
        gain: (2, 2) of the innovations.
        whitening: (n_measured, n_measured) of the innovations.
        sample: Time between samples [s].
        encoder: What is wrong with its encoder.
    """

    joint: Joint
    step: float
    n_sub: int
    inertia: Array
    bias: Array
    slope: Array
    reference: Array
    load: Array
    command: Array
    position: Array
    velocity: Array
    noise: Array
    start: Array
    side: str
    process: float
    changes: Mapping[str, Array]
    payloads: Mapping[str, Array]
    centres: Mapping[str, Array]
    sample: float
    encoder: Encoder = TRUE
    gain: Array = field(init=False)
    whitening: Array = field(init=False)

    def __post_init__(self) -> None:
        gain, whitening = self._filter()
        object.__setattr__(self, "gain", gain)
        object.__setattr__(self, "whitening", whitening)

    @property
    def servo_command(self) -> Array:
        """The input (n_steps,), that of a servo less the offset of its encoder."""
        drive = self.joint.drive
        wrong = drive is not None and drive.servo and self.encoder.in_loop > 0.5
        return self.command - self.encoder.offset if wrong else self.command

    @property
    def servo_ratio(self) -> float:
        """What a servo reads over the true position."""
        return 1.0 + self.encoder.gain if self.encoder.in_loop > 0.5 else 1.0

    @property
    def on_link(self) -> bool:
        """Whether the encoder is known to sit on the link."""
        return self.side == "link"

    @property
    def n_measured(self) -> int:
        """Number of measured channels of the joint."""
        return len(self.noise)

    @property
    def window(self) -> int:
        """Samples that a free run goes without drifting off; zero where a servo holds it, so that it goes for the whole record."""
        drive = self.joint.drive
        return 0 if drive is not None and drive.servo else max(2, round(WINDOW / self.sample))

    def _system(self) -> tuple[Array, Array, Array, Array]:
        """Transition, process noise, observation and noise of the joint about its mean inertia, sample by sample."""
        drive, m = self.joint.drive, float(np.mean(self.inertia))
        assert drive is not None
        stiffness = drive.gear * drive.kp + float(np.mean(self.slope)) if drive.servo else 0.0
        damping = self.joint.damping + (drive.gear * drive.kv if drive.servo else 0.0)
        transition = expm(np.array([[0.0, 1.0], [-stiffness / m, -damping / m]]) * self.sample)
        push = np.array([0.5 * self.sample**2, self.sample]) / m
        process = np.outer(push, push) * self.process**2
        return (
            np.asarray(transition, dtype=np.float64),
            process,
            np.eye(2)[: self.n_measured],
            np.diag(self.noise**2),
        )

    def _covariance(self) -> Array:
        """Stationary covariance (2, 2) of the predicted state."""
        transition, process, observed, noise = self._system()
        try:
            return np.asarray(solve_discrete_are(transition.T, observed.T, process, noise))
        except (np.linalg.LinAlgError, ValueError):
            return np.zeros((2, 2))

    def _filter(self) -> tuple[Array, Array]:
        """Stationary gain, and the whitening of the innovations."""
        _, _, observed, noise = self._system()
        covariance = self._covariance()
        innovation = observed @ covariance @ observed.T + noise
        gain = np.zeros((2, 2))
        gain[:, : self.n_measured] = covariance @ observed.T @ np.linalg.inv(innovation)
        return gain, np.asarray(np.linalg.inv(np.linalg.cholesky(innovation)), dtype=np.float64)

    def free_run_noise(self) -> float:
        """RMS error of the position that noise alone leaves in a free run in windows."""
        transition, process, observed, noise = self._system()
        covariance = self._covariance()
        gain = covariance @ observed.T @ np.linalg.inv(observed @ covariance @ observed.T + noise)
        state = covariance - gain @ observed @ covariance
        total, count = 0.0, self.window or len(self.position)
        for _ in range(count):
            total += state[0, 0] + noise[0, 0]
            state = transition @ state @ transition.T + process
        return float(np.sqrt(total / count))


WINDOW = 0.5
"""Length of a free run of a joint that no servo holds [s]: some time constants of its drive, and far less than it takes to drift off."""


class Encoders(NamedTuple):
    """The encoders of a joint.

    Attributes:
        channels: Its channels, by increasing order.
        orders: (n_channels,) 0 or 1.
        noise: (n_channels,).
    """

    channels: tuple[CaseChannel, ...]
    orders: tuple[int, ...]
    noise: Array


def encoders_of(case: Case, joint: Joint) -> Encoders:
    """The channels that measure a joint.

    Raises:
        FileFormatError: Its position is not measured.
    """
    found = {}
    for channel in case.channels:
        if channel.role == "response" and channel.target == f"joint:{joint.name}":
            if channel.quantity not in ORDERS:
                raise FileFormatError(
                    f"channel '{channel.name}' has the quantity '{channel.quantity}'; position or velocity of a joint is expected"
                )
            found[ORDERS[channel.quantity]] = channel
    if 0 not in found:
        raise FileFormatError(
            f'nothing measures the position of joint \'{joint.name}\'; give a channel "joint": "{joint.name}", '
            '"quantity": "position", or weld the joint where it was held'
        )
    channels = tuple(found[order] for order in sorted(found))
    noise = np.array([noise_of(channel) for channel in channels])
    return Encoders(channels, tuple(sorted(found)), noise)


def noise_of(channel: CaseChannel) -> float:
    """Noise of an encoder: as stated, at least that of its resolution."""
    return max(channel.noise_std or 0.0, channel.resolution / np.sqrt(12.0))


def input_of(case: Case, joint: Joint) -> CaseChannel:
    """The channel that drives a joint.

    Raises:
        FileFormatError: There is none.
    """
    for channel in case.channels:
        if joint.drive is not None and channel.target == f"actuator:{joint.drive.name}":
            return channel
    raise FileFormatError(
        f"no channel drives joint '{joint.name}'; name its command or torque by \"actuator\", or weld the joint where it was held"
    )


class Motion(NamedTuple):
    """Measured motion of all joints, smoothed: positions, velocities, accelerations (n, n_joints) and the smoothers behind them."""

    position: Array
    velocity: Array
    acceleration: Array
    samples: tuple[Array, ...]
    smoothers: tuple[Smoother | None, ...]
    noise: tuple[Array, ...]


def motion_of(
    case: Case,
    model: ArticulatedModel,
    record: CaseRecord,
    encoders: Mapping[str, Encoder],
    like: Motion | None = None,
) -> Motion:
    """Smooth the motion of a record; `encoders` says what is wrong with which joint, `like` has smoothers to be used again.

    A delay shifts the smoothed motion. The samples keep theirs: interpolated, they would have less noise than was logged.
    """
    clock = np.arange(len(record)) * record.step
    out = np.zeros((3, len(record), len(model.joints)))
    samples, smoothers, noises = [], [], []
    for j, joint in enumerate(model.joints):
        measured = encoders_of(case, joint)
        wrong = encoders.get(joint.name, TRUE)
        raw = np.column_stack([record.values[c.name] for c in measured.channels])
        true = wrong.corrected(raw, measured.orders)
        noise = wrong.scaled(measured.noise, measured.orders)
        still = resting(true, measured.orders, noise)
        smoother = like.smoothers[j] if like else None
        if still is None and smoother is None:
            smoother = smoother_of(true, measured.orders, noise, record.step)
        if like is not None and wrong == TRUE:
            out[:, :, j] = np.stack([like.position[:, j], like.velocity[:, j], like.acceleration[:, j]])
        elif still is not None or smoother is None:
            out[:, :, j] = (still if still is not None else np.zeros((len(record), 3))).T
        else:
            smooth = smoother.smooth(true)
            if wrong.delay:
                smooth = CubicSpline(clock, smooth, axis=0)(np.minimum(clock + wrong.delay, clock[-1]))
            out[:, :, j] = smooth.T
        samples.append(true)
        smoothers.append(smoother)
        noises.append(noise)
    return Motion(out[0], out[1], out[2], tuple(samples), tuple(smoothers), tuple(noises))


@dataclass(frozen=True, eq=False)
class PreparedRecord:
    """A record, prepared for all joints.

    Attributes:
        record: The record.
        motion: Its smoothed motion.
        joints: (n_joints,) what every joint's equation needs.
    """

    record: CaseRecord
    motion: Motion
    joints: tuple[JointRecord, ...]

    def read_by(self, encoders: Mapping[str, Encoder]) -> PreparedRecord:
        """The record with encoders that differ in what reads them alone."""
        joints = []
        for joint in self.joints:
            new = copy.copy(joint)
            object.__setattr__(new, "encoder", encoders.get(joint.joint.name, joint.encoder))
            joints.append(new)
        return replace(self, joints=tuple(joints))


def prepare(case: Case, model: ArticulatedModel, record: CaseRecord) -> PreparedRecord:
    """Prepare a record for all joints of a model at its nominal parameters."""
    motion = motion_of(case, model, record, {})
    moved = (motion.position, motion.velocity, motion.acceleration)
    clock = _clock(record)
    dynamics = model.dynamics(*moved)
    base = _Coefficients.of(dynamics, motion, clock)

    def beside(changed: Dynamics) -> Array:
        """Changes of bias and inertia (n_joints, 2, n_steps)."""
        return _Coefficients.of(_difference(changed, dynamics), motion, clock).stacked

    masses = {
        body: beside(model.with_mass(body, model.mass(body) + 1.0).dynamics(*moved)) for body in model.bodies
    }
    payloads = {body: beside(model.with_payload(body, 1.0).dynamics(*moved)) for body in model.bodies}
    centres = {
        body: np.stack(
            [beside(model.with_centre(body, SHIFT * axis).dynamics(*moved)) / SHIFT for axis in np.eye(3)]
        )
        for body in model.bodies
    }
    slope = clock.between(model.slopes(*moved))
    process = _torque_noise(model, motion, record.step)
    joints = []
    for j, joint in enumerate(model.joints):
        drive, channel = joint.drive, input_of(case, joint)
        assert drive is not None
        stated = 0.0 if drive.servo else (channel.noise_std or 0.0) * abs(drive.gear * drive.kp)
        joints.append(
            JointRecord(
                joint, record.step / clock.n_sub, clock.n_sub, base.inertia[j] + joint.armature, base.bias[j], slope[j],
                base.reference[j], base.load[j], _input(case, record, channel, clock), *_measured(motion, j),
                encoders_of(case, joint).channels[0].side, float(np.hypot(stated, process[j])),
                {b: c[j] for b, c in masses.items()}, {b: c[j] for b, c in payloads.items()},
                {b: np.ascontiguousarray(c[:, j]) for b, c in centres.items()}, record.step,
            )
        )  # fmt: skip
    return PreparedRecord(record, motion, tuple(joints))


def corrected(
    case: Case,
    model: ArticulatedModel,
    prepared: PreparedRecord,
    encoders: Mapping[str, Encoder],
) -> PreparedRecord:
    """A prepared record, the logs of its encoders corrected; derivatives by masses and postures are kept as they were."""
    motion = motion_of(case, model, prepared.record, encoders, prepared.motion)
    clock = _clock(prepared.record)
    dynamics = model.dynamics(motion.position, motion.velocity, motion.acceleration)
    now = _Coefficients.of(dynamics, motion, clock)
    joints = []
    for j, old in enumerate(prepared.joints):
        position, velocity, noise, start = _measured(motion, j)
        new, command = now, old.command
        wrong = encoders.get(old.joint.name, TRUE)
        if wrong.delay:  # what acts on the joint is late by as much, on the clock of its log
            late = clock.later(wrong.delay)
            new = _Coefficients.of(dynamics, motion, late)
            command = _input(case, prepared.record, input_of(case, old.joint), late)
        joints.append(
            replace(
                old, inertia=new.inertia[j] + old.joint.armature, bias=new.bias[j], reference=new.reference[j], load=new.load[j],
                command=command, position=position, velocity=velocity, noise=noise, start=start, encoder=wrong,
            )
        )  # fmt: skip
    return PreparedRecord(prepared.record, motion, tuple(joints))


def relinked(
    case: Case, model: ArticulatedModel, prepared: PreparedRecord, links: Mapping[int, Array]
) -> PreparedRecord:
    """A prepared record with links where the runs of their elastic joints have them, not where their motors are.

    Args:
        case: The case.
        model: Its model.
        prepared: The record.
        links: Joint to position and velocity (n, 2) of its link.
    """
    step = prepared.record.step
    out = [np.array(part) for part in prepared.motion[:3]]
    sections = butter(2, min(2.0 * FOLLOWED * step, 0.9), output="sos")
    for j, states in links.items():
        away = sosfiltfilt(sections, states - np.column_stack([out[0][:, j], out[1][:, j]]), axis=0)
        out[0][:, j] += away[:, 0]
        out[1][:, j] += away[:, 1]
        out[2][:, j] += np.gradient(away[:, 1], step)
    motion = prepared.motion._replace(position=out[0], velocity=out[1], acceleration=out[2])
    clock = _clock(prepared.record)
    dynamics = model.dynamics(*out)
    now = _Coefficients.of(dynamics, motion, clock)
    joints = [
        replace(
            old, inertia=now.inertia[j] + old.joint.armature, bias=now.bias[j], reference=now.reference[j], load=now.load[j]
        )
        for j, old in enumerate(prepared.joints)
    ]  # fmt: skip
    return PreparedRecord(prepared.record, prepared.motion, tuple(joints))


FOLLOWED = 20.0
"""Frequency [Hz] up to which links are moved: what a robot is driven with lies below, and a second derivative lives on what lies above."""


class _Clock(NamedTuple):
    """Samples of a record, and the middles of the integration steps between them."""

    samples: Array
    middles: Array
    n_sub: int

    def later(self, delay: float) -> _Clock:
        """The middles of steps that lie `delay` [s] earlier, from the first sample on."""
        return self._replace(middles=np.maximum(self.middles - delay, 0.0))

    def between(self, samples: Array) -> Array:
        """Values (n, n_joints) at the samples, at the middles (n_joints, n_steps)."""
        return np.ascontiguousarray(CubicSpline(self.samples, samples, axis=0)(self.middles).T)


def _clock(record: CaseRecord) -> _Clock:
    n_sub = max(1, int(np.ceil(record.step / LONGEST_STEP - 1e-9)))
    middles = (np.arange((len(record) - 1) * n_sub) + 0.5) * (record.step / n_sub)
    samples = np.arange(len(record)) * record.step
    return _Clock(np.asarray(samples, dtype=np.float64), np.asarray(middles, dtype=np.float64), n_sub)


class _Coefficients(NamedTuple):
    """Coefficients of the equations of all joints (n_joints, n_steps)."""

    bias: Array
    inertia: Array
    reference: Array
    load: Array

    @classmethod
    def of(cls, dynamics: Dynamics, motion: Motion, clock: _Clock) -> _Coefficients:
        """Coefficients along a motion; the bias is the torque besides that of the joint's own acceleration."""
        bias = clock.between(dynamics.torque - dynamics.inertia * motion.acceleration)
        load = np.abs(clock.between(dynamics.torque))
        return cls(bias, clock.between(dynamics.inertia), clock.between(motion.position), load)

    @property
    def stacked(self) -> Array:
        """Bias and inertia (n_joints, 2, n_steps)."""
        return np.stack([self.bias, self.inertia], axis=1)


def _measured(motion: Motion, j: int) -> tuple[Array, Array, Array, Array]:
    """Measured positions, velocities, their noise, and the start of joint `j`."""
    samples = motion.samples[j]
    velocity = np.ascontiguousarray(samples[:, 1]) if samples.shape[1] > 1 else np.zeros(0)
    start = np.array([motion.position[0, j], motion.velocity[0, j]])
    return np.ascontiguousarray(samples[:, 0]), velocity, motion.noise[j], start


SHIFT = 1e-4
"""Shift of a centre of mass for its derivative [m]."""


def _difference(changed: Dynamics, base: Dynamics) -> Dynamics:
    return Dynamics(changed.torque - base.torque, changed.inertia - base.inertia)


def _input(case: Case, record: CaseRecord, channel: CaseChannel, clock: _Clock) -> Array:
    """The input at the middle of every step."""
    samples = record.values[channel.name]
    if case.load_interpolation == "zero_order_hold":
        return samples[np.searchsorted(clock.samples, clock.middles, side="right") - 1]
    if case.load_interpolation == "band_limited":
        return np.asarray(CubicSpline(clock.samples, samples)(clock.middles), dtype=np.float64)
    return np.interp(clock.middles, clock.samples, samples)


def _torque_noise(model: ArticulatedModel, motion: Motion, step: float) -> Array:
    """White torque noise (n_joints,), one-sigma a sample, as strong as what the noise of the measured motion makes of the bias."""
    rng = np.random.default_rng(NOISE_SEED)
    n, nj = motion.position.shape
    noise = np.zeros((3, n, nj))
    for j, (smoother, level) in enumerate(zip(motion.smoothers, motion.noise, strict=True)):
        if smoother is not None:
            noise[:, :, j] = smoother.smooth(rng.standard_normal((n, len(level))) * level).T
    q, v, a = motion.position, motion.velocity, motion.acceleration
    base = model.dynamics(q, v, a)
    other = model.dynamics(q + noise[0], v + noise[1], a + noise[2])
    made = (other.torque - other.inertia * (a + noise[2])) - (base.torque - base.inertia * a)
    frequency, power = welch(made, 1.0 / step, nperseg=min(1024, n), axis=0)
    band = (frequency > SERVO_BAND[0]) & (frequency < SERVO_BAND[1])
    return np.asarray(np.sqrt(power[band].mean(axis=0) / (2.0 * step)), dtype=np.float64)
