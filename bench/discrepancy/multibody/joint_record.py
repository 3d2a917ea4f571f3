"""One joint of an articulated model in one record: what its equation needs along the measured motion, and its noise.

The gain of the innovations is the stationary Kalman gain of the joint about its mean inertia. Its process noise is the stated noise of the
measured torque, and what the noise of the other joints' motion makes of the torque of the inverse dynamics; both pass through the
model once, as one draw.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Mapping
from dataclasses import dataclass, field
from threading import Lock

import numpy as np
from scipy.linalg import expm, solve_discrete_are

from bench.arrays import Array
from bench.discrepancy.multibody.body_numbers import BodyNumbers
from bench.discrepancy.multibody.body_terms import BodyTerms, GravityTerms
from bench.discrepancy.multibody.encoders import TRUE, Encoder
from bench.discrepancy.multibody.joint_forces import Slot
from bench.discrepancy.multibody.joints import Joint


@dataclass(frozen=True)
class JointRecordSettings:
    """Numbers of `bench.discrepancy.multibody.joint_record`."""

    window: float = 0.5
    """Length of a free run of a joint that no servo holds [s]: some time constants of its drive, and far less than it takes to drift
    off."""
    kept: int = 3
    """Coefficients kept: most runs of a joint change nothing of the bodies, and a column of a Jacobian for a body comes between two of
    them."""
    lightest: float = 1e-3
    """Inertia about the joint that is left, over the nominal one, however much is taken off the bodies."""


JOINT_RECORD_SETTINGS = JointRecordSettings()


def window_of(joint: Joint, sample: float) -> int:
    """Samples that a free run of a joint goes without drifting off; zero where a servo holds it, so that it goes for the whole record."""
    return 0 if joint.held else max(2, round(JOINT_RECORD_SETTINGS.window / sample))


def judged_from(window: int, samples: int) -> int:
    """Sample from which free runs of windows as of `window_of` are judged: the second window, where there is one.

    At the end of a record the velocity is told from one side alone, several times worse than within.
    """
    return window if window < samples else 0


@dataclass(frozen=True, eq=False)
class JointRecord:
    """One joint in one record.

    Attributes:
        joint: The joint.
        step: Integration step [s].
        n_sub: Integration steps a sample.
        inertia: (n_steps,) armature included; bias, slope, reference likewise, see `joint_run.run`.
        bias: (n_steps,).
        slope: (n_steps,).
        reference: (n_steps,).
        acceleration: (n_steps,) measured.
        command: (n_steps,) input.
        position: (n,) measured.
        velocity: (n,) measured, or (0,).
        noise: (n_measured,).
        start: (2,) smoothed position and velocity at the first sample.
        start_covariance: (2, 2) of them.
        side: "motor" or "link", where the encoder sits; empty where nobody says.
        process: Equivalent white noise of the torque, one-sigma a sample.
        bodies: Body with uncertain numbers to what they change.
        payloads: Body to the changes of bias and inertia (2, n_steps) by a kilogram at its tip.
        centres: The same (3, 2, n_steps) for a metre of its centre of mass along each axis.
        weights: Body to the change of bias (n_steps,) by its weight.
        gravity: What the direction of gravity changes.
        beside: Neighbour in the tree to its velocity (n_steps,).
        touches: End of the tree to its lowest point (3, n_steps): its height, by how much the joint raises it, and how fast the others do.
        sample: Time between samples [s].
        encoder: What is wrong with its encoder.
        weight: (n, n_measured) of the innovations, one where every reading tells something new, see `weight_of_readings`.
        filter: Gain (2, 2) and whitening (n_measured, n_measured) of the innovations; made for the joint about its mean inertia where None.
            A corrected log keeps those of the log: they are what innovations are compared by.
    """

    joint: Joint
    step: float
    n_sub: int
    inertia: Array
    bias: Array
    slope: Array
    reference: Array
    acceleration: Array
    command: Array
    position: Array
    velocity: Array
    noise: Array
    start: Array
    start_covariance: Array
    side: str
    process: float
    bodies: Mapping[str, BodyTerms]
    payloads: Mapping[str, Array]
    centres: Mapping[str, Array]
    weights: Mapping[str, Array]
    gravity: GravityTerms
    beside: Mapping[str, Array]
    touches: Mapping[str, Array]
    sample: float
    weight: Array
    encoder: Encoder = TRUE
    filter: tuple[Array, Array] | None = None
    _made: OrderedDict[object, tuple[Array, Array]] = field(
        init=False, repr=False, default_factory=OrderedDict
    )
    _making: Lock = field(init=False, repr=False, default_factory=Lock)

    def __post_init__(self) -> None:
        if self.filter is None:
            object.__setattr__(self, "filter", self._filter())

    @property
    def gain(self) -> Array:
        """Gain (2, 2) of the innovations."""
        assert self.filter is not None
        return self.filter[0]

    @property
    def whitening(self) -> Array:
        """Whitening (n_measured, n_measured) of the innovations."""
        assert self.filter is not None
        return self.filter[1]

    @property
    def innovation(self) -> Array:
        """Standard deviation (n_measured,) of the innovations."""
        root = np.linalg.inv(self.whitening)
        return np.asarray(np.sqrt(np.diag(root @ root.T)))

    def coefficients(self, numbers: BodyNumbers) -> tuple[Array, Array]:
        """Bias and inertia (n_steps,) with bodies that are not as the model has them; not to be written to."""
        changed = [(body, by) for body, by in numbers.changed.items() if self.bodies[body].felt]
        key = tuple(tuple((body, *by.items()) for body, by in some) for some in (changed, numbers.missing))
        with self._making:
            if key in self._made:
                self._made.move_to_end(key)
                return self._made[key]
        made = np.stack([self.bias, self.inertia])
        for body, by in changed:
            self.bodies[body].change(made, by)
        for body, values in numbers.missing:
            made += self._left_out(body, values)
        found = made[0], np.maximum(made[1], JOINT_RECORD_SETTINGS.lightest * self.inertia)
        with self._making:
            self._made[key] = found
            while len(self._made) > JOINT_RECORD_SETTINGS.kept:
                self._made.popitem(last=False)
        return found

    def load(self, bias: Array, inertia: Array, p: Array) -> Array:
        """Magnitude (n_steps,) of the torque that the gear carries along the measured motion, for bias and inertia as of `coefficients`:
        what moves the link and holds it, the inertia of its own motor not counted; anything where no friction of `p` grows with it."""
        carried = p[Slot.CARRIED] != 0.0
        return np.abs(bias + (inertia - self.joint.armature) * self.acceleration) if carried else bias

    def _left_out(self, body: str, values: Mapping[str, float]) -> Array:
        """Changes of bias and inertia (2, n_steps) by what the model leaves out at a body, or at the base."""
        if "payload" in values:
            return self.payloads[body] * values["payload"]
        if "share" in values:
            return np.stack([-values["share"] * self.weights[body], np.zeros_like(self.bias)])
        if "tilt_x" in values:
            return np.stack([self.gravity.change(*values.values()), np.zeros_like(self.bias)])
        return np.asarray(np.tensordot(np.array(list(values.values())), self.centres[body], axes=1))

    @property
    def servo_command(self) -> Array:
        """The input (n_steps,), that of a servo less the offset of its encoder."""
        drive = self.joint.drive
        wrong = self.joint.held and self.encoder.in_loop > 0.5
        return self.command - drive.gear * self.encoder.offset if drive and wrong else self.command

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
        """Samples of a free run, see `window_of`."""
        return window_of(self.joint, self.sample)

    def _system(self) -> tuple[Array, Array, Array, Array]:
        """Transition, process noise, observation and noise of the joint about its mean inertia, sample by sample."""
        drive, m = self.joint.drive, float(np.mean(self.inertia))
        assert drive is not None
        stiffness = drive.stiffness + float(np.mean(self.slope)) if drive.servo else 0.0
        damping = self.joint.damping + drive.damping
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
