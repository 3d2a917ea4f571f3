"""The measured friction damper: identified on the test at one frequency, judged on the other, the same band tension; eight tests.

One frequency and one amplitude do not tell what depends on the rate from what depends on the place, so the joint with memory is
given no damping and no spring to the ground here: slip elements only, whose limits may differ as a band brake's do.
"""

from __future__ import annotations

import warnings

import numpy as np

from bench.demo.damper import DAMPER_SETUP, damper_motion, damper_record, identify_damper
from bench.errors import RangeWarning
from bench.identification.memory import MemorySettings, fit_memory
from bench.recording import Recording, nrmse
from bench.rig import Element, simulate
from bench.rig.library import damper_rig, prescribe, starting
from memory.rivals import lstm, narx
from memory.row import Progress, Row

_RATE_INDEPENDENT = {"unequal": True, "cells": 0, "knots": 0, "substeps": 1}
FORMS = {
    "memory, sliders": MemorySettings(form="sliders", slips=8, smallest=0.02, parts=8, **_RATE_INDEPENDENT),
    "memory, profiles": MemorySettings(form="profiles", slips=2, parts=12, **_RATE_INDEPENDENT),
}


def _scores(element: Element, unseen: Recording) -> tuple[float, float]:
    """NRMSE of the force, and what is left of it beside the gain and the constant that fit best, which no model knows."""
    x = unseen["displacement"]
    rig = damper_rig(element, timestep=1.0 / unseen.sample_rate)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RangeWarning)
        record = simulate(rig, prescribe(rig, x), initial=starting(rig, x))
    measured, predicted = unseen["force"][unseen.scored], record["damper/force"][unseen.scored]
    columns = np.stack([predicted, np.ones_like(predicted)], axis=1)
    freed = columns @ np.linalg.lstsq(columns, measured, rcond=None)[0]
    return nrmse(measured, predicted), nrmse(measured, freed)


def rows(progress: Progress) -> list[Row]:
    """Rows of the task."""
    found = []
    for seen, judged in (("0.5", "1"), ("1", "0.5")):
        for tension in DAMPER_SETUP.tensions:
            task = f"friction damper, {tension} lbf, judged at {judged} Hz"
            progress(task)
            record, unseen = damper_record(seen, tension), damper_record(judged, tension)
            elements = identify_damper(record, np.random.default_rng(5))
            both = {label: _scores(element, unseen) for label, element in elements.items()}
            motion = damper_motion(record)
            states = np.concatenate([motion.displacement, motion.velocity], axis=1)
            for label, settings in FORMS.items():
                model = fit_memory(
                    states, motion.force, time=motion.time, settle=record.settle, settings=settings
                )
                both[label] = _scores(Element(model.law, ("piston",), model.theta, name="damper"), unseen)
            scores = {label: score for label, (score, _) in both.items()}
            other = damper_motion(unseen)
            along = np.concatenate([other.displacement, other.velocity], axis=1)
            for label, made in (
                ("NARX, degree 2", narx(states, motion.force, motion.time, along, other.time)),
                (
                    "LSTM of equal size",
                    lstm(states, motion.force, motion.time, along, other.time, size=70, seconds=10.0),
                ),
            ):
                if made is not None:
                    scores[label] = nrmse(unseen["force"][unseen.scored], made[0][unseen.scored, 0])
            limit = {"memory, sliders": scores["parametric"]}
            found += [
                Row(task, label, "NRMSE of the force, unseen", score, "1", limit.get(label))
                for label, score in scores.items()
            ]
            found += [
                Row(
                    task,
                    label,
                    "NRMSE of the force, unseen, less the gain and the constant that fit best",
                    both[label][1],
                    "1",
                )
                for label in ("parametric", "memory, sliders")
            ]
    return found
