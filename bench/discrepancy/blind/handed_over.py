"""A sealed case as a laboratory hands it over: true responses to records with noise, and a nominal model that is a little off."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from bench.arrays import Array
from bench.discrepancy.case.case import Case, CaseChannel, NominalParameter, record_from_arrays
from bench.discrepancy.truth.background import Background
from bench.discrepancy.truth.ground_truth import (
    GROUND_TRUTH_SETTINGS,
    Truth,
)
from bench.discrepancy.truth.rigs import Bench

UNITS = {
    "force": "N", "torque": "N m", "displacement": "m", "acceleration": "m/s^2", "rotation": "rad",
    "angular_acceleration": "rad/s^2", "mass": "kg", "inertia": "kg m^2",
}  # fmt: skip


@dataclass(frozen=True)
class HandedOverSettings:
    """Numbers of `bench.discrepancy.blind.handed_over`."""

    spreads: Mapping[str, Mapping[str, float]] = field(
        default_factory=lambda: {
            "sdof": {"mass": 0.01, "stiffness": 0.03, "damping": 0.2},
            "damper": {"stiffness": 0.03, "damping": 0.05},
            "joint": {
                "mass": 0.01,
                "inertia": 0.01,
                "mount_stiffness": 0.01,
                "mount_damping": 0.05,
                "joint_stiffness": 0.05,
                "joint_damping": 0.25,
            },
        }
    )
    """Relative one-sigma uncertainties of the nominal parameters."""
    hushed: float = 0.01
    """Part of the noise left in the records that detectability is computed from: an axis at rest has a spectrum then."""
    transducer: float = 0.1
    """Noise of a prescribed displacement over that of the force: a machine's own transducer is its best channel."""


HANDED_OVER_SETTINGS = HandedOverSettings()


def _parameters(truth: Truth, rng: np.random.Generator) -> tuple[NominalParameter, ...]:
    """Nominal values, the true ones lying within their stated uncertainty."""
    out = []
    for name, value in truth.values.items():
        kind = (
            name
            if truth.rig != "joint"
            else next(k for k in HANDED_OVER_SETTINGS.spreads["joint"] if name.startswith(k))
        )
        spread = HANDED_OVER_SETTINGS.spreads[truth.rig][kind]
        torsional = "torsional" in name
        unit = next(
            (u for k, u in UNITS.items() if name.startswith(k)),
            ("N m/rad" if torsional else "N/m")
            if "stiffness" in name
            else ("N m s/rad" if torsional else "N s/m"),
        )
        out.append(
            NominalParameter(
                name, value * (1.0 + spread * float(rng.standard_normal())), value * spread, unit
            )
        )
    return tuple(out)


def hand_over(
    name: str,
    bench: Bench,
    responses: Sequence[Mapping[str, Array]],
    rng: np.random.Generator,
    background: Background | None = None,
) -> tuple[Case, Case]:
    """The case as a laboratory hands it over, noise added and truth left out; and the same almost without noise."""
    plan, truth = bench.plan, bench.truth
    names = {"joint": ("force", "torque"), "sdof": ("force",), "damper": ("displacement",)}[plan.rig]
    every = GROUND_TRUTH_SETTINGS.steps if plan.rig == "damper" else 1
    clean = [
        {**{c: sampled[::every, j] for j, c in enumerate(names)}, **r}
        for sampled, r in zip(bench.loads, responses, strict=True)
    ]
    if background is not None:
        # a command is exact, and a prescribed motion differentiated: what comes into it would be no small thing
        exact = names if plan.commanded or plan.rig == "damper" else ()
        timed = [c for c in clean[0] if c not in exact]
        judged = next(iter(bench.judged()[0]))
        clean = background.recorded_in(clean, judged=judged, timed=timed, step=1.0 / truth.rate, rng=rng)
    channels, levels = [], {}
    for c in clean[0]:
        level = plan.noise * max(float(np.std(r[c])) for r in clean[:-1])
        role = "response"
        if c in names:
            role = "prescribed" if plan.rig == "damper" else ("command" if plan.commanded else "measured")
            level *= {"prescribed": HANDED_OVER_SETTINGS.transducer, "command": 0.0, "measured": 1.0}[role]
        unit = UNITS[c.rsplit("_", 1)[0] if c[-1].isdigit() else c]
        levels[c] = level
        stated = level if background is None or level == 0.0 else background.noise_stated(level)
        channels.append(CaseChannel(c, unit, role, stated))
    parameters = _parameters(truth, rng)
    split = len(clean) - 1

    def case(noise: float) -> Case:
        records = [
            record_from_arrays(
                label,
                np.arange(len(r[names[0]])) / truth.rate,
                {
                    c.name: r[c.name] + noise * levels[c.name] * rng.standard_normal(len(r[c.name]))
                    for c in channels
                },
            )
            for label, r in zip(bench.names, clean, strict=True)
        ]
        return Case(
            name, plan.rig, parameters, tuple(channels), tuple(records[:split]), tuple(records[split:])
        )

    return case(1.0), case(HANDED_OVER_SETTINGS.hushed)
