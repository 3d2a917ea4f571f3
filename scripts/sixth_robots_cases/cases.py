"""The nine cases: which robot, how it is moved and logged, and what is missing from its model.

README.md in this folder tells of each case what is right to say of it.
"""

from __future__ import annotations

import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from sixth_robots_cases.effects import Effects, kind_of
from sixth_robots_cases.fleet import CRANE, DESK, DIGGER, LEG, PICK, SCARA, WHEEL_LEG
from sixth_robots_cases.references import Signal
from sixth_robots_cases.robots import Robot


@dataclass(frozen=True)
class Laboratory:
    """How a case was measured.

    Attributes:
        rate: Samples a second [Hz].
        noise: Standard deviation of the noise of each position [rad or m] (n).
        steps: Steps of the encoders [rad or m] (n), which are stated.
        load_noise: That of measured torques, over what a drive is rated for; goals, speeds and torques that are asked for have none.
        colour: Part of the variance of the noise that is slow.
        said: Whether the noise is stated, stated too small by a factor of two, or left out.
        role: Of the loads.
        angle, length: Units of the log.
    """

    rate: float
    noise: tuple[float, ...]
    steps: tuple[float, ...]
    load_noise: float = 0.0
    colour: float = 0.3
    said: Literal["right", "half", "none"] = "right"
    role: Literal["measured", "command"] = "command"
    angle: Literal["rad", "deg"] = "rad"
    length: Literal["m", "mm"] = "m"


@dataclass(frozen=True)
class RobotCase:
    """A case before it is simulated.

    Attributes:
        name: Of its folder, from which its seed follows.
        robot: As stated.
        posture: About which it moves [rad or m] (n).
        laboratory: How it was measured.
        records: Signals by the names of the records; the last one is for validation.
        effects: What is missing.
        truth: The same in words.
        shift: Added to the seed.
        longest_step: Longest step of the simulation [s].
    """

    name: str
    robot: Robot
    posture: tuple[float, ...]
    laboratory: Laboratory
    records: Mapping[str, Signal]
    effects: Effects
    truth: str
    shift: int = 0
    longest_step: float = 1e-4

    @property
    def kind(self) -> Literal["single", "double", "foreign", "none"]:
        """See `kind_of`."""
        return kind_of(self.effects, self.robot)

    def rng(self, what: str) -> np.random.Generator:
        """Random numbers of one thing in this case, the same at every run."""
        return np.random.default_rng(zlib.crc32(f"{self.name}/{what}".encode()) + self.shift)


def four_records(
    size: tuple[float, ...],
    band: tuple[float, float],
    seconds: float,
    pause: tuple[float, float],
    swing: float = 1.0,
) -> Mapping[str, Signal]:
    """Signals of four records.

    Args:
        size: Largest excursions about the posture [rad or m] (n).
        band: Frequencies [Hz].
        seconds: Duration [s].
        pause: Move and rest of a move from point to point [s].
        swing: How far sines go, over the moves from point to point.
    """
    low, high = band
    sines = tuple(swing * s for s in size)
    return {
        "identification": Signal("multisine", seconds, sines, band),
        "identification_2": Signal("points", seconds, size, pause=pause),
        "identification_3": Signal(
            "chirp", seconds, tuple(0.8 * s for s in sines), (low + 0.1 * (high - low), high)
        ),
        "validation": Signal("multisine", seconds, tuple(0.9 * s for s in sines), (low, 0.8 * high)),
    }


def scara_cases() -> tuple[RobotCase, RobotCase]:
    """The SCARA: an elastic belt of the elbow, and nothing but faint friction."""
    records = four_records((0.5, 0.6, 0.05), (0.2, 9.0), 10.0, (0.6, 0.3), swing=0.25)
    noise, steps = (8e-5, 8e-5, 1.5e-5), (6e-5, 6e-5, 1e-5)
    soft = RobotCase(
        "sixth_scara_1", SCARA, (0.2, 0.5, -0.05),
        Laboratory(500.0, noise, steps, load_noise=0.006, role="measured"), records,
        Effects(train={"elbow": (220.0, 0.12, 0.0)}),
        "the belt of the elbow is elastic: 220 N m/rad between motor and fore arm",
    )  # fmt: skip
    clean = RobotCase(
        "sixth_scara_2", SCARA, (-0.3, 0.8, -0.04),
        Laboratory(250.0, noise, steps, load_noise=0.006, colour=0.4, said="half", role="measured"),
        four_records((0.45, 0.6, 0.04), (0.2, 5.0), 12.0, (0.6, 0.3), swing=0.6), Effects(),
        "nothing of size",
    )  # fmt: skip
    return soft, clean


def leg_case() -> RobotCase:
    """The leg of the quadruped: a drive of the hip that is late, and dry friction of the knee."""
    return RobotCase(
        "sixth_leg_1", LEG, (0.05, 0.5, -0.9),
        Laboratory(500.0, (2e-4, 2e-4, 2e-4), (1e-4, 1e-4, 1e-4)),
        four_records((0.3, 0.4, 0.45), (0.3, 8.0), 10.0, (0.35, 0.35)),
        Effects(delay={"hip": 0.014}, friction={"knee": 0.25}),
        "the hip's drive is 14 ms late; dry friction of 0.25 N m at the knee",
    )  # fmt: skip


def desk_case() -> RobotCase:
    """The arm for a desk: play of the pan."""
    step = 0.00153398
    return RobotCase(
        "sixth_desk_1", DESK, (0.1, -0.5, 0.9, 0.2),
        Laboratory(100.0, (4e-4,) * 4, (step,) * 4, said="none", angle="deg"),
        four_records((0.8, 0.45, 0.5, 0.6), (0.1, 2.5), 15.0, (0.6, 0.5)),
        Effects(train={"pan": (150.0, 0.1, 0.06)}),
        "worn gear of the pan: 60 mrad of play between servo and turret",
    )  # fmt: skip


def crane_cases() -> tuple[RobotCase, RobotCase]:
    """The crane for a camera, whose base leans, and in whose head a wheel spins."""
    noise, steps = (1.2e-4, 1.2e-4, 1.5e-4), (1e-4, 1e-4, 1e-4)
    leaning = RobotCase(
        "sixth_crane_1", CRANE, (0.3, -0.1, 0.1),
        Laboratory(100.0, noise, steps, load_noise=0.008, said="half", role="measured"),
        four_records((0.7, 0.25, 0.4), (0.05, 0.8), 20.0, (1.6, 0.8)),
        Effects(tilt=(4.0, -2.5)), "the dolly leans by 4 deg about x and -2.5 deg about y",
    )  # fmt: skip
    gyro = RobotCase(
        "sixth_crane_2", CRANE, (-0.2, 0.05, -0.1),
        Laboratory(100.0, noise, steps, load_noise=0.008, role="measured"),
        four_records((0.6, 0.2, 0.45), (0.05, 1.0), 20.0, (1.4, 0.7)),
        Effects(spin=(1.2, 0.0, 0.3)),
        "a stabiliser spins in the head: an angular momentum of 1.2 N m s along its x and 0.3 along its z",
    )  # fmt: skip
    return leaning, gyro


def pick_case() -> RobotCase:
    """The head that picks and places: cogging of the gantry."""
    return RobotCase(
        "sixth_pick_1", PICK, (0.0, -0.05, 0.2),
        Laboratory(250.0, (1.5e-5, 1.5e-5, 4e-4), (1e-5, 1e-5, 3e-4), colour=0.2, said="none", length="mm"),
        four_records((0.16, 0.03, 1.2), (0.1, 3.0), 12.0, (0.5, 0.3)),
        Effects(cogging={"gantry": (22.0, 0.030, 0.7)}),
        "the linear motor of the gantry cogs: 22 N every 30 mm",
    )  # fmt: skip


def digger_case() -> RobotCase:
    """The digger: soil in its bucket."""
    return RobotCase(
        "sixth_digger_1", DIGGER, (-0.5, 0.9, -0.3),
        Laboratory(200.0, (1.5e-4, 1.5e-4, 2e-4), (1e-4, 1e-4, 1e-4), load_noise=0.008, role="measured", angle="deg"),
        four_records((0.3, 0.4, 0.6), (0.1, 1.8), 15.0, (0.9, 0.6)),
        Effects(mass={"bucket": 1.5}), "1.5 kg of soil in the bucket, at its centre of mass",
    )  # fmt: skip


def wheel_leg_case() -> RobotCase:
    """The leg with a wheel: a servo of the knee that saturates, and a brake that drags."""
    return RobotCase(
        "sixth_wheelleg_1", WHEEL_LEG, (0.4, -0.9, 0.0),
        Laboratory(200.0, (2.5e-4, 2.5e-4, 5e-4), (2e-4, 2e-4, 4e-4)),
        four_records((0.4, 0.5, 2.5), (0.2, 4.0), 12.0, (0.3, 0.5)),
        Effects(limit={"knee": 4.5}, friction={"wheel": 0.3}),
        "the knee's servo gives 4.5 N m where 30 are stated; the wheel's brake drags by 0.3 N m",
    )  # fmt: skip


def robot_cases() -> dict[str, RobotCase]:
    """All cases by their names."""
    cases = (
        *scara_cases(), leg_case(), desk_case(), *crane_cases(), pick_case(), digger_case(), wheel_leg_case(),
    )  # fmt: skip
    return {case.name: case for case in cases}
