"""Doubts about records of an articulated model, joint by joint: drives and encoders that are missing, still, late or turned round."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.integrate import cumulative_trapezoid

from bench.arrays import Array
from bench.discrepancy.articulated.admission import admitted_robot
from bench.discrepancy.case.case import Case, CaseRecord
from bench.discrepancy.checks.channel_comparison import compare_channels
from bench.discrepancy.model.mjcf_file import rig_of
from bench.discrepancy.multibody.channels import bound
from bench.discrepancy.multibody.encoders import encoders_of
from bench.discrepancy.multibody.inputs import input_of
from bench.discrepancy.multibody.model import ArticulatedModel
from bench.discrepancy.multibody.nominal_parameters import nominal_parameters
from bench.discrepancy.precheck.positions import position_doubts
from bench.discrepancy.precheck.timing import timing
from bench.errors import BenchError, RecordingError


@dataclass(frozen=True)
class JointsSettings:
    """Numbers of `bench.discrepancy.precheck.joints`."""

    follows: float = 0.5
    """Correlation of a servo's target with its joint from which their sizes tell something."""
    still: float = 30.0
    """Noise that the motion of a joint has to exceed, so that friction and inertia can be told from it."""
    reversals: int = 4
    """Reversals of a joint that its friction needs to be told from gravity."""


SETTINGS = JointsSettings()


def admitted_joints(case: Case) -> tuple[Case | None, ArticulatedModel | None, list[str]]:
    """The case as the diagnosis takes it, its model, and what is said of both; what it would refuse is said, nothing is raised.

    Without case and model where these cannot be read at all, or no diagnosis can use the records.
    """
    found: list[str] = []
    try:
        try:
            own, compiled, notes = admitted_robot(case, anyway=True)
            found += notes
        except RecordingError as error:
            return None, None, [str(error)]
        except (
            BenchError
        ) as error:  # the first thing that is refused; what else is doubtful is told all the same
            found.append(str(error))
            compiled = rig_of(case).model
            own = bound(case, compiled)
        model = ArticulatedModel.of(compiled)
        nominal_parameters(own, model)
        return own, model, found
    except BenchError as error:
        return None, None, list(dict.fromkeys((*found, " ".join(str(error).split()))))


def joint_doubts(own: Case, model: ArticulatedModel) -> list[str]:
    """What is doubtful about the records of an articulated case, a sentence each.

    Args:
        own: The case, its channels bound to joints and actuators.
        model: Its model.
    """
    found: list[str] = []
    for joint in model.joints:
        try:
            encoders = encoders_of(own, joint)
            driving = input_of(own, joint)
        except BenchError as error:
            found.append(str(error))
            continue
        position = encoders.channels[0]
        servo = joint.held
        motions = [np.asarray(record.values[position.name]) for record in own.identification]
        found += _moves(joint.name, motions, float(position.noise_std or 0.0))
        for record in own.identification:
            q = np.asarray(record.values[position.name])
            u = np.asarray(record.values[driving.name])
            noise = float(position.noise_std or 0.0)
            target = u / (joint.drive.gear or 1.0) if servo and joint.drive is not None else None
            found += position_doubts(position.name, record, noise, target)
            if servo:
                found += _follows(joint.name, driving.name, record, q, u)
            velocity = next((c for c in encoders.channels if c.quantity == "velocity"), None)
            if velocity is not None:
                of_velocity = float(velocity.noise_std or 0.0)
                found += _derivatives(position.name, velocity.name, record, q, noise, of_velocity)
    return list(dict.fromkeys(found))


def _moves(joint: str, motions: Sequence[Array], noise: float) -> Iterator[str]:
    """What the motion (n,) of a joint in the records cannot tell, taken together: it may well be held in some of them."""
    moving = [q for q in motions if np.ptp(q) > SETTINGS.still * max(noise, 1e-12)]
    if not moving:
        yield f"joint '{joint}' hardly moves in any record: its friction, inertia and drive cannot be told from that"
        return
    turns = sum(_reversals(q) for q in moving)
    if turns < SETTINGS.reversals:
        yield f"joint '{joint}' reverses {turns} time(s) in all; {SETTINGS.reversals} are wanted to tell friction from gravity"


def _reversals(q: Array) -> int:
    """How often a motion (n,) turns round, by more than a twentieth of its range."""
    smooth = np.convolve(q, np.ones(5) / 5.0, "valid")
    hysteresis = 0.05 * np.ptp(smooth)
    turns, last, rising = 0, smooth[0], True
    for value in smooth:
        if rising:
            last = max(last, value)
            if value < last - hysteresis:
                turns, last, rising = turns + 1, value, False
        else:
            last = min(last, value)
            if value > last + hysteresis:
                turns, last, rising = turns + 1, value, True
    return turns


def _follows(joint: str, target: str, record: CaseRecord, q: Array, u: Array) -> Iterator[str]:
    if min(np.std(q), np.std(u)) == 0.0:
        return
    correlation = float(np.corrcoef(q, u)[0, 1])
    if correlation < -SETTINGS.follows:
        yield f"joint '{joint}' runs against its target '{target}' in '{record.name}'; turn one of them round"
    factor = float(np.std(q) / np.std(u))
    if abs(correlation) > SETTINGS.follows and not 0.2 < factor < 5.0:
        yield (
            f"joint '{joint}' moves {factor:.3g} times as far as its target '{target}' in '{record.name}': degrees, or a gear?"
        )


def _derivatives(
    position: str, velocity: str, record: CaseRecord, q: Array, noise_q: float, noise_v: float
) -> Iterator[str]:
    v = np.asarray(record.values[velocity])
    pair = compare_channels(q, v, orders=(0, 1), noise=(noise_q, noise_v), step=record.step)
    if pair is None or abs(pair.correlation) < 0.9:
        return
    if pair.correlation < 0.0:
        yield f"'{position}' and '{velocity}' have opposite signs in '{record.name}'; turn one of them round"
    if not 0.5 < pair.factor < 2.0:
        yield f"'{position}' is {pair.factor:.3g} times what '{velocity}' says in '{record.name}': look at their units"
    # an integral runs off by the zero of the velocity, which a slope takes up
    turned = cumulative_trapezoid(np.sign(pair.correlation) * v, dx=record.step, initial=0.0)
    shift = timing(q, turned, record.step, np.linspace(-1.0, 1.0, len(q))[:, None])
    if shift is not None and abs(shift.lag) > shift.least(record.step):
        late, early = (position, velocity) if shift.lag > 0.0 else (velocity, position)
        yield f"'{late}' lags '{early}' by {1e3 * abs(shift.lag):.3g} ms in '{record.name}'; align them"
