"""A harmonic force from outside, of a frequency of its own: the unbalance of a rotor, hum of a drive, a machine next door.

``F`` acts towards positive displacement, so that the law, which is what the structure loses, is

    f = -F cos(2 pi nu t + phi).

Time is the clock of the record. The centrifugal force of an unbalance ``m e`` at the speed ``Omega`` is ``F = m e Omega^2`` along any
axis across the shaft, with ``nu = Omega/(2 pi)``. `timed_force` is a force that is switched on and off, `cogging` one that repeats
along the stroke, not in time.

References:
    S. S. Rao, Mechanical Vibrations, 5th ed., Pearson 2011, section 3.7 (response under rotating unbalance).
"""

from __future__ import annotations

import math

from bench.laws.base import ForceLaw, Parameter, kernel


@kernel
def force(t, q, v, z, theta, f):
    """``-F cos(2 pi nu t + phi)``."""
    f[0] -= theta[0] * math.cos(2.0 * math.pi * theta[1] * t + theta[2])


HARMONIC_FORCE = ForceLaw(
    name="harmonic_force",
    parameters=(
        Parameter("force", "N", 5.0, (-math.inf, math.inf), "amplitude F", "N m"),
        Parameter("frequency", "Hz", 1.0, (0.0, math.inf), "frequency nu"),
        Parameter("phase", "rad", 0.0, (-math.inf, math.inf), "phase phi at time zero"),
    ),
    force=force,
    equation="f = -F cos(2 pi nu t + phi)",
    reference="Rao 2011, section 3.7",
    smoothness="smooth",
)
