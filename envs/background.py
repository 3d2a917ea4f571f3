"""What the rigs of a laboratory have besides their joints: springs that are not quite straight, damping that is not quite linear."""

from __future__ import annotations

from dataclasses import dataclass

from bench.excitation.background import BackgroundTerm

from .setups import Setup


@dataclass(frozen=True)
class EnvBackgroundSettings:
    """Numbers of `envs.background`."""

    share: float = 0.1
    """Standard deviation of each term's force at the limit of stroke or velocity, as a share of the largest force of the drive: on
    the SDOF rig a fiftieth of the spring's force and a tenth of the damper's, which no inspection would find."""

    laws: tuple[tuple[str, str, int, bool], ...] = (
        ("quadratic_stiffness", "k2", 2, False),
        ("cubic_stiffness", "k3", 3, False),
        ("quadratic_damping", "c2", 2, True),
    )
    """Law, parameter, power of the motion, and whether that is the velocity."""


SETTINGS = EnvBackgroundSettings()


def background_of(setup: Setup) -> tuple[BackgroundTerm, ...]:
    """The background of the rigs of a laboratory, on each joint that is driven."""
    limits = setup.limits
    return tuple(
        BackgroundTerm(
            law,
            joint,
            parameter,
            SETTINGS.share
            * limits.force[actuator]
            / (limits.velocity[velocity] if moving else limits.stroke[stroke]) ** power,
        )
        for joint, (actuator, stroke, velocity) in setup.place.driven.items()
        for law, parameter, power, moving in SETTINGS.laws
    )
