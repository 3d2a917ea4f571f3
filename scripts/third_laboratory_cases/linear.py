"""Responses of the linear nominal models, by their transfer functions: they start at rest."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from bench.arrays import Array
from third_laboratory_cases.joint_rig import Axis

Transfer = NDArray[np.complex128]
"""Values of a transfer function (n_frequencies,)."""


def filtered(load: Array, rate: float, transfer: Callable[[Array], Sequence[Transfer]]) -> list[Array]:
    """Responses (n,) to a load (n,) at a sample rate [Hz].

    Args:
        load: The load.
        rate: Its sample rate [Hz].
        transfer: The transfer functions at angular frequencies [rad/s], one a response.
    """
    n = 1 << (3 * len(load)).bit_length()  # decays are over before they come round again
    omega = 2.0 * np.pi * np.asarray(np.fft.rfftfreq(n, 1.0 / rate), float)
    spectrum = np.fft.rfft(load, n)
    return [np.fft.irfft(spectrum * h, n)[: len(load)] for h in transfer(omega)]


def oscillator_response(mass: float, damping: float, stiffness: float, load: Array, rate: float) -> Array:
    """Displacement (n,) of an oscillator under a load (n,)."""

    def transfer(omega: Array) -> list[Transfer]:
        return [1.0 / (stiffness - mass * omega * omega + 1j * damping * omega)]

    return filtered(load, rate, transfer)[0]


def axis_response(axis: Axis, load: Array, rate: float) -> list[Array]:
    """Displacements (n,) of both bodies of a joint rig on one axis, under a load (n,) on the first; linear properties alone."""

    def transfer(omega: Array) -> list[Transfer]:
        joint = axis.joint_stiffness + 1j * axis.joint_damping * omega
        first = axis.mount_stiffness_1 + 1j * axis.mount_damping_1 * omega - axis.mass_1 * omega**2 + joint
        second = axis.mount_stiffness_2 + 1j * axis.mount_damping_2 * omega - axis.mass_2 * omega**2 + joint
        shared = first * second - joint * joint
        return [second / shared, joint / shared]

    return filtered(load, rate, transfer)
