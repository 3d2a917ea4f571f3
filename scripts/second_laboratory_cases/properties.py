"""Physical properties of an oscillator or a component with one degree of freedom."""

from __future__ import annotations

from typing import NamedTuple


class Properties(NamedTuple):
    """Properties of an oscillator or a component with one degree of freedom; compiled functions take them as they are.

    Units are those of a translation. Where the motion is a rotation, read rad for m, N m for N and kg m^2 for kg. An effect whose first
    property is zero is absent.
    """

    mass: float = 0.0
    """Mass [kg], what it carries included."""
    stiffness: float = 0.0
    """Linear stiffness [N/m]."""
    damping: float = 0.0
    """Viscous damping [N s/m]."""
    cubic_stiffness: float = 0.0
    """Coefficient of the cube of the displacement [N/m^3]."""
    stop_stiffness: float = 0.0
    """Stiffness [N/m] of a stop on either side."""
    gap_above: float = 0.0
    """Positive displacement [m] from which the upper stop is touched."""
    gap_below: float = 0.0
    """Negative displacement [m], without its sign, from which the lower stop is touched."""
    stop_damping: float = 0.0
    """Viscous damping [N s/m] while the upper stop is touched."""
    gravity_torque: float = 0.0
    """Torque of the weight [N m] of a pendulum that hangs when the angle is zero, at a right angle."""
    cogging: float = 0.0
    """Amplitude of a force [N] that is periodic in the displacement."""
    cogging_pitch: float = 1.0
    """Period of that force [m]."""
    cogging_phase: float = 0.0
    """Phase of that force at zero displacement [rad]."""
    parametric_stiffness: float = 0.0
    """Amplitude [N/m] of a stiffness that is harmonic in time."""
    parametric_frequency: float = 0.0
    """Frequency of that stiffness [Hz]."""
    parametric_phase: float = 0.0
    """Phase of that stiffness at the start of a record [rad]."""
    swing_stiffness: float = 0.0
    """Amplitude [N/m] of a slow swing of the stiffness, as ambient temperature causes it."""
    swing_frequency: float = 0.0
    """Frequency of that swing [Hz]."""
    quadratic_damping: float = 0.0
    """Coefficient of v |v| [N s^2/m^2]."""
    power_damping: float = 0.0
    """Coefficient of sign(v) |v|^n [N (s/m)^n]."""
    power_exponent: float = 1.0
    """The exponent n of it."""
    damping_asymmetry: float = 0.0
    """Damping [N s/m] that is added when the velocity is positive and subtracted when it is negative."""
    metered_damping: float = 0.0
    """Coefficient of x^2 v [N s/m^3]: damping that grows with the square of the displacement."""
    coulomb: float = 0.0
    """Dry friction while sliding [N]."""
    stribeck_excess: float = 0.0
    """Excess of the friction at rest over `coulomb`, as a fraction of it."""
    stribeck_velocity: float = 1.0
    """Velocity [m/s] over which that excess decays as a Gaussian."""
    friction_per_deflection: float = 0.0
    """Dry friction that is proportional to the deflection [N/m]."""
    stroke_friction: float = 0.0
    """Largest value [N] of a dry friction that varies along the stroke between zero and it."""
    stroke_period: float = 1.0
    """Period of that variation [m]."""
    bouc_wen_stiffness: float = 0.0
    """The parameter A of a Bouc-Wen element whose state is its force [N/m]."""
    bouc_wen_beta: float = 0.0
    """The parameter beta of that element [1/(m N^(n-1))]."""
    bouc_wen_gamma: float = 0.0
    """The parameter gamma of that element [1/(m N^(n-1))]."""
    bouc_wen_exponent: float = 1.0
    """The exponent n of that element."""
    dahl_stiffness: float = 0.0
    """Stiffness [N/m] of Dahl friction before it slides."""
    dahl_force: float = 1.0
    """Force of Dahl friction when it slides [N]."""
    relaxing_stiffness: float = 0.0
    """Stiffness [N/m] of a Maxwell element (a spring in series with a dashpot)."""
    relaxation_time: float = 1.0
    """Relaxation time of that element [s]."""
    carried_mass: float = 0.0
    """Part of `mass` [kg] that is mounted on the rest by a spring and a dashpot."""
    carried_omega: float = 0.0
    """Natural frequency of the carried mass on the blocked rest [rad/s]."""
    carried_ratio: float = 0.0
    """Damping ratio of the carried mass."""
    hidden_mass: float = 0.0
    """A second carried mass [kg], which `mass` does not include."""
    hidden_omega: float = 0.0
    """Its natural frequency on the blocked rest [rad/s]."""
    hidden_ratio: float = 0.0
    """Its damping ratio."""
    harmonic_force: float = 0.0
    """Amplitude of a harmonic force [N] that nobody measures."""
    harmonic_frequency: float = 0.0
    """Frequency of that force [Hz]."""
    harmonic_phase: float = 0.0
    """Phase of that force at the start of a record [rad]."""
    ball_mass: float = 0.0
    """Mass [kg] of a ball that flies freely in a cavity of the mass."""
    ball_gap: float = 0.0
    """Travel [m] of the ball from the centre of the cavity to either wall."""
    ball_restitution: float = 0.0
    """Coefficient of restitution between ball and wall."""
