"""Limits of set-valued friction, for the simulator of the fits.

A friction limit is a kernel like any other: it adds the largest friction force at the present state into ``f``, and the
simulator decides between sliding and sticking. One that writes a creep velocity and a lead time besides (``f[1]``, ``f[2]``)
never sticks: it creeps, as MuJoCo's `frictionloss` does (`bench.laws.soft_friction`). The laws of `bench.laws` smooth the
sign function instead, as MuJoCo needs it; where the velocity is well above their regularising velocity, limit and law are the same
force.
"""

from __future__ import annotations

import math

from bench.laws.base import kernel


@kernel
def coulomb_limit(t, q, v, z, theta, f):
    """``limit = Fc``."""
    f[0] += theta[0]


@kernel
def soft_coulomb_limit(t, q, v, z, theta, f):
    """``limit = Fc``, with the creep velocity and the lead time of `soft_coulomb`."""
    f[0] += theta[0]
    f[1] += theta[1]
    f[2] += theta[2]


@kernel
def stribeck_limit(t, q, v, z, theta, f):
    """``limit = Fc (1 + s exp(-(v/vs)^2))``."""
    f[0] += theta[0] * (1.0 + theta[1] * math.exp(-((v[0] / theta[2]) ** 2)))


@kernel
def load_dependent_limit(t, q, v, z, theta, f):
    """``limit = mu |q|``."""
    f[0] += theta[0] * abs(q[0])


@kernel
def time_varying_limit(t, q, v, z, theta, f):
    """``limit = Fc (1 + a sin(2 pi f t + phi))``."""
    f[0] += theta[0] * (1.0 + theta[1] * math.sin(2.0 * math.pi * theta[2] * t + theta[3]))
