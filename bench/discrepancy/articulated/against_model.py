"""Factors and signs of a recording, by the nominal equation of every joint.

Joint by joint, the input that the nominal model asks for along the measured motion is held against the one recorded. Wrong or missing
forces change their ratio from band to band; a unit changes it by one factor in all bands, a turned encoder or motor turns it in all.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from bench.arrays import Array
from bench.discrepancy.case.case import Case, CaseRecord
from bench.discrepancy.checks.bands import bands_between, common_factor, compare_channels, spectra
from bench.discrepancy.checks.scales import grossly_apart, model_words, pair_words, shown_noise, suggestion
from bench.discrepancy.multibody.encoders import encoders_of
from bench.discrepancy.multibody.inputs import input_of, load_on
from bench.discrepancy.multibody.joints import Joint
from bench.discrepancy.multibody.model import ArticulatedModel
from bench.discrepancy.multibody.motion import JointMotion, Moving
from bench.discrepancy.settings import ChecksSettings, ScaleSettings


def suspicions(
    declared: Case, case: Case, model: ArticulatedModel, moving: list[Moving], checks: ChecksSettings
) -> tuple[str, ...]:
    """Factors and signs of the recording, a sentence each; what is found first makes nonsense of the comparisons after it."""
    # the input asked for is an inverse: no resonance turns its sign, only inertia and stiffness near the frequency at which they cancel
    settings = replace(checks.scales, octaves=min(checks.scales.octaves, 1.0))
    for found in (
        _between(declared, case, model, settings, checks),
        _beyond_ranges(declared, case, model, settings),
        _against_model(declared, case, model, moving, settings),
    ):
        said = tuple(dict.fromkeys(found))
        if said:
            return said
    return ()


def _between(
    declared: Case, case: Case, model: ArticulatedModel, settings: ScaleSettings, checks: ChecksSettings
) -> Iterator[str]:
    """Position and velocity of one joint that are no derivatives of one another."""
    for joint in model.joints:
        channels = encoders_of(case, joint).channels
        if len(channels) < 2:
            continue
        first, second = (channel.name for channel in channels)
        for record in case.identification:
            pair = compare_channels(
                record.values[first], record.values[second], orders=(0, 1), step=record.step, settings=settings,
                noise=(shown_noise(case, first, record), shown_noise(case, second, record)),
            )  # fmt: skip
            if pair is not None and grossly_apart(pair, settings):
                yield pair_words(declared, second, first, pair, 1, record, settings=checks)


def _beyond_ranges(
    declared: Case, case: Case, model: ArticulatedModel, settings: ScaleSettings
) -> Iterator[str]:
    """Joints that travel far more than their stops let them."""
    for joint in model.joints:
        name, width = encoders_of(case, joint).channels[0].name, joint.range[1] - joint.range[0]
        for record in case.identification:
            travelled = float(np.ptp(record.values[name]))
            if travelled > settings.gross * width:
                # whatever factor brings it between its stops may be the unit's: the nearest one known is asked for
                hint = suggestion(declared, name, travelled / width, travelled / width)
                yield (
                    f"'{name}' travels {travelled:.4g} {joint.unit} in '{record.name}', and the stops of joint '{joint.name}' are "
                    f"{width:.4g} {joint.unit} apart: {hint or 'correct its unit, or the range in the model'}"
                )


def _against_model(
    declared: Case, case: Case, model: ArticulatedModel, moving: list[Moving], settings: ScaleSettings
) -> Iterator[str]:
    """Joints whose recorded input is the one that the nominal model asks for but for a factor or a sign.

    An encoder in a wrong unit makes nonsense of the torques on its neighbours, too: what a unit explains comes first.
    """
    said = []
    for j, joint in enumerate(model.joints):
        channel, position = input_of(case, joint).name, encoders_of(case, joint).channels[0].name
        found = []
        for record, motion in moving:
            noise = (shown_noise(case, channel, record), 0.0)
            asked = asked_input(case, model, joint, j, record, motion)
            bands = bands_between(spectra(record.values[channel], asked, record.step, noise, settings))
            if bands is not None:
                # a geared joint that carries little but its friction asks for many times the torque of its bodies, of another course
                found.append(common_factor(bands, settings, more=joint.torque_driven))
        if found and all(one != (1.0, 1.0) for one in found):
            factor = float(np.exp(np.mean([np.log(one) for one, _ in found])))
            sign = -1.0 if all(turned < 0.0 for _, turned in found) else 1.0
            explained = any(
                suggestion(declared, name, times)
                for name, times in ((position, factor), (channel, 1.0 / factor))
            )
            said.append((not explained, model_words(declared, (position,), (channel,), factor, sign)))
    yield from (words for _, words in sorted(said, key=lambda entry: entry[0]))


def asked_input(
    case: Case, model: ArticulatedModel, joint: Joint, j: int, record: CaseRecord, motion: JointMotion
) -> Array:
    """The input (n,) of a joint's drive along the motion of a record, by its nominal equation without dry friction."""
    drive = joint.drive
    assert drive is not None
    asked = needed(model, joint, j, motion) - load_on(case, joint, record)
    return drive.command(asked, motion.position[:, j], motion.velocity[:, j])


def needed(model: ArticulatedModel, joint: Joint, j: int, motion: JointMotion) -> Array:
    """Torque (n,) that the nominal equation of a joint asks of its actuators, without dry friction."""
    q, v, a = motion.position, motion.velocity, motion.acceleration
    bodies = model.dynamics(q, v, a).torque[:, j]
    return (
        bodies
        + joint.armature * a[:, j]
        + joint.damping * v[:, j]
        + joint.stiffness * (q[:, j] - joint.reference)
    )
