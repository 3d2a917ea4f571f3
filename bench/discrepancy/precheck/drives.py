"""Faults of what drives a joint, told against the input that its nominal equation asks for along its motion: another clock, another
quantity."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from bench.arrays import Array
from bench.discrepancy.articulated.against_model import asked_input
from bench.discrepancy.case.case import Case, CaseRecord
from bench.discrepancy.multibody.encoders import encoders_of
from bench.discrepancy.multibody.inputs import input_of
from bench.discrepancy.multibody.joints import Joint
from bench.discrepancy.multibody.model import ArticulatedModel
from bench.discrepancy.multibody.motion import motion_of
from bench.discrepancy.precheck.loads import is_magnitude
from bench.discrepancy.precheck.settings import CheckSettings
from bench.discrepancy.precheck.timing import Timing, timing
from bench.discrepancy.settings import DEFAULT
from bench.errors import BenchError


@dataclass(frozen=True)
class DrivesSettings:
    """Numbers of `bench.discrepancy.precheck.drives`."""

    latest: float = 0.025
    """Delay [s] up to which it is a drive's own: the frame of 20 ms of an RC servo's pulses, the slowest command that is in use, and a
    quarter of it for what computes."""
    sigmas: float = 2.0
    """Stated standard deviations of the damping that may make a servo lag otherwise than its model: 95 %."""
    alike: float = 0.5
    """Correlation of a servo's target with what the motion asks for, below which it is the target of something else."""


SETTINGS = DrivesSettings()


def drive_doubts(own: Case, model: ArticulatedModel, settings: CheckSettings) -> Iterator[str]:
    """What is wrong with the inputs of the drives, a sentence each.

    Args:
        own: The case, its channels bound to joints and actuators.
        model: Its model.
        settings: When something counts.
    """
    for record in own.identification:
        try:
            motion = motion_of(own, model, record, {}, settings=DEFAULT.motion)
        except BenchError:
            continue  # a joint is not measured, which is said elsewhere
        for j, joint in enumerate(model.joints):
            if joint.drive is None or joint.drive.kp == 0.0:
                continue
            asked, velocity = asked_input(own, model, joint, j, record, motion), motion.velocity[:, j]
            yield from _of_joint(own, joint, record, asked, velocity, settings)


def _of_joint(
    own: Case, joint: Joint, record: CaseRecord, asked: Array, velocity: Array, settings: CheckSettings
) -> Iterator[str]:
    channel = input_of(own, joint).name
    given = np.asarray(record.values[channel])
    if min(np.std(given), np.std(asked)) == 0.0 or joint.drive is None:
        return
    if is_magnitude(given, asked, settings):
        yield (
            f"'{channel}' in '{record.name}' never changes its sign, while the motion of joint '{joint.name}' asks for both: it looks like "
            "a magnitude (an unsigned current?); give it its sign"
        )
        return
    if not joint.drive.servo:
        return  # friction that is missing shifts a torque against what is asked for, as a clock does
    correlation = float(np.corrcoef(given, asked)[0, 1])
    friction = np.sign(velocity)[:, None] * (np.abs(velocity) > 0.0)[:, None]
    found = timing(given, asked, record.step, friction)
    if abs(correlation) < SETTINGS.alike and (found is None or abs(found.lag) < record.step):
        yield (
            f"joint '{joint.name}' does not follow '{channel}' in '{record.name}' (correlation {correlation:.2f} with the target that its "
            "motion asks for): the target of another joint, or another quantity?"
        )
    elif found is not None:
        yield from _of_clocks(own, joint, record, found, settings)


def _of_clocks(
    own: Case, joint: Joint, record: CaseRecord, found: Timing, settings: CheckSettings
) -> Iterator[str]:
    """A servo that answers far later than the model, or before it, or at a time that runs off."""
    channel, position = input_of(own, joint).name, encoders_of(own, joint).channels[0].name
    assert joint.drive is not None
    held = 0.5 * record.step if own.load_interpolation == "zero_order_hold" else 0.0
    late = -found.lag - held - joint.drive.delay  # the joint after the target, beyond what the model says
    least = found.least(record.step)
    hold = joint.drive.stiffness or abs(joint.drive.gear) * joint.drive.kp
    # a servo lags by its damping over its gain, and by the delay that its model states
    overstated = joint.damping / hold + joint.drive.delay
    stated = [p.std for p in own.parameters if p.name in (f"damping:{joint.name}", f"kv:{joint.drive.name}")]
    unsure = SETTINGS.sigmas * float(np.hypot.reduce(stated or [0.0])) / hold
    if found.left > settings.shift:
        return  # a wrong law lags as well, and otherwise where the motion is another, but no shift takes it away
    if found.drifts(record.step):
        yield (
            f"the lag between '{channel}' and '{position}' changes by {1e3 * found.drift:.3g} ms along '{record.name}': their clocks drift "
            "apart; resample one of them"
        )
        return
    if late > max(SETTINGS.latest + unsure, least):
        yield (
            f"'{position}' answers '{channel}' {1e3 * late:.3g} ms later than the model does in '{record.name}', more than a drive's own "
            "delay: look whether one clock logged the two, else the diagnosis takes it for a delay or for damping"
        )
    elif -late > least + overstated:
        yield (
            f"'{position}' answers '{channel}' {-1e3 * late:.3g} ms before the model does in '{record.name}': their clocks differ; "
            "align them"
        )
