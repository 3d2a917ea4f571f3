"""The rigs of sealed cases before anything is withheld: true parameters, loads, and how they move with given effects."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from bench.discrepancy.truth.background_settings import BackgroundSettings
from bench.discrepancy.truth.ground_truth import (
    GROUND_TRUTH_SETTINGS,
    ROWS,
    Truth,
    WithheldEffect,
    force_under,
    motion_of,
    sensed,
)
from bench.discrepancy.truth.loads import RIGS_SETTINGS, SIGNALS, Array, load, machine_motion
from bench.discrepancy.truth.moreau_time_stepping import TrueMotion
from bench.discrepancy.truth.recipe import Reach, Recipe
from bench.discrepancy.truth.withheld_effects import recipe_named
from bench.errors import ParameterError

SENSORS = ("both", "position", "acceleration")


@dataclass(frozen=True)
class BlindOptions:
    """What sealed cases are drawn from.

    Attributes:
        gap: Smallest and largest wanted gap (NRMSE of the judged channels), drawn log-uniformly.
        noise: Smallest and largest noise, as a part of the standard deviation of a channel, drawn log-uniformly.
        sensors: Sensor sets to draw from: "both", "position", "acceleration".
        signals: Kinds of loads to draw from.
        duration: Length of a record [s].
        sample_rate: [Hz].
        shares: Probabilities of none, single, double and foreign cases.
        rigs: Probabilities of sdof, damper and joint.
        robots: Kinds of robots to draw from instead of rigs: "arm", "leg", "servo".
        effects: Names of effects to draw from, foreign ones included; all where empty.
        leave_one_out: Strike the true effect from the catalogue that the diagnosis may use; single cases only.
        detectability: Compute how well the records of a case can tell its effect (a second or two a case).
        background: What a background is drawn from; None where nothing but noise is in the records besides.
    """

    gap: tuple[float, float] = (0.03, 0.6)
    noise: tuple[float, float] = (0.003, 0.03)
    sensors: tuple[str, ...] = SENSORS
    signals: tuple[str, ...] = SIGNALS
    duration: float = 10.0
    sample_rate: float = 500.0
    shares: tuple[float, float, float, float] = (0.15, 0.55, 0.15, 0.15)
    rigs: tuple[float, float, float] = (0.65, 0.15, 0.2)
    robots: tuple[Literal["arm", "leg", "servo"], ...] = ()
    effects: tuple[str, ...] = ()
    leave_one_out: bool = False
    detectability: bool = True
    background: BackgroundSettings | None = None

    def __post_init__(self) -> None:
        for name in self.effects if not self.robots else ():
            recipe_named(name)
        if self.robots and (self.background is not None or self.leave_one_out):
            raise ParameterError(
                "cases of robots have no background and strike nothing; leave both out, or make cases of other rigs"
            )
        if self.background is not None and self.shares[2]:
            raise ParameterError(
                "a background is put beside one effect or none: give shares (clean, single, double, foreign) whose third is zero, as "
                + " ".join(str(share) for share in RIGS_SETTINGS.background_shares)
            )
        for label, known, chosen in (
            ("sensor set", SENSORS, self.sensors),
            ("signal", SIGNALS, self.signals),
        ):
            unknown = set(chosen) - set(known)
            if unknown:
                raise ParameterError(
                    f"unknown {label} {', '.join(sorted(unknown))}; known: {', '.join(known)}"
                )


@dataclass(frozen=True)
class CasePlan:
    """What a case is to be, before its numbers are drawn."""

    kind: str
    rig: str
    recipes: tuple[Recipe, ...]
    places: tuple[str, ...]
    sensors: str
    commanded: bool
    gap: float
    noise: float


@dataclass(frozen=True)
class Bench:
    """A rig with its loads: what answers "how does it move with these effects?".

    Attributes:
        plan: What the case is to be.
        truth: The rig.
        names: Names of the records, judging ones last.
        signals: Their kinds.
        loads: (n, n_loads) each; for a prescribed motion the displacement, sampled finely (n * STEPS, 1).
    """

    plan: CasePlan
    truth: Truth
    names: tuple[str, ...]
    signals: tuple[str, ...]
    loads: tuple[Array, ...]

    def responses(
        self, effects: Sequence[WithheldEffect], *, quick: bool = False, judging: bool = True
    ) -> list[dict[str, Array]]:
        """Response channels of every record without noise; see `run`."""
        return [r for r, _ in self.run(effects, quick=quick, judging=judging)]

    def run(
        self, effects: Sequence[WithheldEffect], *, quick: bool = False, judging: bool = True
    ) -> list[tuple[dict[str, Array], TrueMotion]]:
        """Response channels and motion of every record.

        Args:
            effects: What is withheld.
            quick: Coarse, for a search.
            judging: The validation record as well.
        """
        step = 1.0 / self.truth.rate
        out = []
        for name, loads in zip(self.names, self.loads, strict=True):
            if name.startswith("validation") and not judging:
                continue
            if self.plan.rig == "damper":
                x = loads[:, 0]
                v = np.gradient(x, step / GROUND_TRUTH_SETTINGS.steps)
                force = force_under(self.truth, effects, x, v)
                motion = TrueMotion(
                    x[:: GROUND_TRUTH_SETTINGS.steps, None],
                    v[:: GROUND_TRUTH_SETTINGS.steps, None],
                    np.zeros((len(force), 1)),
                )
                out.append(({"force": force}, motion))
                continue
            motion = motion_of(self.truth, effects, loads, quick=quick)
            channels = {
                channel: sensed(effects, channel, motion[order][:, column], step)
                for channel, order, column in _channels(self.plan)
            }
            out.append((channels, motion))
        return out

    def gaps(
        self, with_effects: Sequence[Mapping[str, Array]], without: Sequence[Mapping[str, Array]]
    ) -> list[float]:
        """NRMSE of the model without the effects, for every judged coordinate over the given records."""
        found = []
        for signs in self.judged():
            real = np.concatenate([sum(s * r[c] for c, s in signs.items()) for r in with_effects])
            model = np.concatenate([sum(s * r[c] for c, s in signs.items()) for r in without])
            with np.errstate(over="ignore", invalid="ignore"):  # a run that diverges has an infinite gap
                gap = np.sqrt(np.mean((model - real) ** 2)) / max(float(np.std(real)), 1e-300)
            found.append(float(gap) if np.isfinite(gap) else np.inf)
        return found

    def judged(self) -> list[dict[str, float]]:
        """The coordinates that a gap is stated for: channels with their signs.

        That is the displacement where it is measured, unless an error of the accelerometer is withheld: it leaves all else alone.
        """
        if self.plan.rig == "damper":
            return [{"force": 1.0}]
        if self.plan.rig == "sdof":
            spoiled = any(r.target == "acceleration" for r in self.plan.recipes)
            return [
                {("acceleration" if spoiled or self.plan.sensors == "acceleration" else "displacement"): 1.0}
            ]
        pairs = (
            ("acceleration", "angular_acceleration")
            if self.plan.sensors == "acceleration"
            else ("displacement", "rotation")
        )
        return [{f"{quantity}_2": 1.0, f"{quantity}_1": -1.0} for quantity in pairs]


def _channels(plan: CasePlan) -> list[tuple[str, int, int]]:
    """(channel, order of the derivative, column of the motion) of the response channels."""
    position, acceleration = plan.sensors != "acceleration", plan.sensors != "position"
    if plan.rig == "sdof":
        table = [("displacement", 0, 0)] * position + [("acceleration", 2, 0)] * acceleration
        return table
    table = []
    if position:
        table += [
            ("displacement_1", 0, 0),
            ("displacement_2", 0, 1),
            ("rotation_1", 0, 2),
            ("rotation_2", 0, 3),
        ]
    if acceleration:
        table += [("acceleration_1", 2, 0), ("angular_acceleration_1", 2, 2)]
        if not position:
            table += [("acceleration_2", 2, 1), ("angular_acceleration_2", 2, 3)]
    return table


def reach_of(bench: Bench, where: str) -> Reach:
    """What the rig does at a place without any effect, over the identification records."""
    truth, plan = bench.truth, bench.plan
    rows = ROWS[plan.rig][where]
    runs = [motion for _, motion in bench.run((), quick=True, judging=False)]
    position = np.max([np.abs(m.position @ rows.T).max(axis=0) for m in runs], axis=0)
    velocity = np.max([np.abs(m.velocity @ rows.T).max(axis=0) for m in runs], axis=0)
    if plan.rig == "joint":
        axes = ("axial", "torsional") if where == "joint" else (where,)
        columns = [("axial", "torsional").index(a) for a in axes]
        both = bench.loads[bench.names.index("identification_both")]
        force = [float(np.sqrt(np.mean(both[:, c] ** 2))) for c in columns]
        stiffness = [truth.values[f"joint_stiffness_{a}"] for a in axes]
    else:
        stiffness = [truth.values["stiffness"]]
        force = (
            [float(np.sqrt(np.mean(bench.responses((), quick=True, judging=False)[0]["force"] ** 2)))]
            if plan.rig == "damper"
            else [float(np.sqrt(np.mean(bench.loads[0] ** 2)))]
        )
    rate = float(velocity[0] / position[0])
    duration = float(len(bench.loads[0]) / truth.rate) / (
        GROUND_TRUTH_SETTINGS.steps if plan.rig == "damper" else 1
    )
    return Reach(
        force[0], float(position[0]), float(velocity[0]), stiffness[0], rate, duration,
        force[-1], float(position[-1]), float(velocity[-1]), stiffness[-1], truth.values.get("mass", 0.0),
    )  # fmt: skip


def draw_bench(plan: CasePlan, rng: np.random.Generator, options: BlindOptions) -> Bench:
    """Draw the rig's true parameters and its loads."""
    rate = options.sample_rate
    n = round(options.duration * rate)
    if plan.rig == "joint":
        values, frequency, levels = _joint_values(rng)
        signals = tuple(str(rng.choice(options.signals)) for _ in range(4))
        names = ("identification_axial", "identification_torsional", "identification_both", "validation")
        active = ((1, 0), (0, 1), (1, 1), (1, 1))
        loads = tuple(
            np.column_stack(
                [
                    on * level * load(s, frequency, n, rate, rng)
                    for on, level in zip(mask, levels, strict=True)
                ]
            )
            for s, mask in zip(signals, active, strict=True)
        )
        return Bench(plan, Truth("joint", values, rate), names, signals, loads)
    signals = tuple(str(rng.choice(options.signals)) for _ in range(2))
    names = ("identification", "validation")
    frequency = float(rng.uniform(2.0, 6.5))
    if plan.rig == "damper":
        frequency = float(rng.uniform(0.5, 2.0))
        stroke = float(rng.uniform(0.004, 0.03))
        stiffness = float(np.exp(rng.uniform(np.log(1e3), np.log(1e5))))
        damping = stiffness / (2.0 * np.pi * frequency) * float(rng.uniform(0.2, 1.0))
        fine = rate * GROUND_TRUTH_SETTINGS.steps
        loads = tuple(
            stroke
            * machine_motion(load(s, frequency, n * GROUND_TRUTH_SETTINGS.steps, fine, rng), frequency, fine)[
                :, None
            ]
            for s in signals
        )
        return Bench(
            plan, Truth("damper", {"stiffness": stiffness, "damping": damping}, rate), names, signals, loads
        )
    mass = float(rng.uniform(2.0, 13.0))
    stiffness = mass * (2.0 * np.pi * frequency) ** 2
    damping = 2.0 * float(rng.uniform(0.02, 0.06)) * np.sqrt(mass * stiffness)
    level = 0.01 * stiffness * float(rng.uniform(0.1, 0.4))
    loads = tuple(level * rng.uniform(0.8, 1.25) * load(s, frequency, n, rate, rng)[:, None] for s in signals)
    values = {"mass": mass, "stiffness": stiffness, "damping": damping}
    return Bench(plan, Truth("sdof", values, rate), names, signals, loads)


def _joint_values(rng: np.random.Generator) -> tuple[dict[str, float], float, tuple[float, float]]:
    values: dict[str, float] = {}
    frequency = float(rng.uniform(3.0, 5.0))
    levels = []
    for axis, inertia, low, high, amplitude in (
        ("axial", "mass", 1.0, 3.0, 0.004), ("torsional", "inertia", 0.01, 0.03, 0.03),
    ):  # fmt: skip
        stiffest = 0.0
        for body in (1, 2):
            m = float(rng.uniform(low, high))
            k = m * (2.0 * np.pi * frequency * float(rng.uniform(0.8, 1.25))) ** 2
            values |= {
                f"{inertia}_{body}": m,
                f"mount_stiffness_{axis}_{body}": k,
                f"mount_damping_{axis}_{body}": 2.0 * float(rng.uniform(0.01, 0.04)) * np.sqrt(k * m),
            }
            stiffest = max(stiffest, k)
        k = stiffest * float(rng.uniform(0.2, 0.7))
        values[f"joint_stiffness_{axis}"] = k
        values[f"joint_damping_{axis}"] = 2.0 * float(rng.uniform(0.02, 0.05)) * float(np.sqrt(k * high))
        levels.append(amplitude * stiffest * float(rng.uniform(0.1, 0.3)))
    return values, frequency, (levels[0], levels[1])
