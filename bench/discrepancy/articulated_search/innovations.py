"""Innovations in units of the noise, and what is not known of where a joint starts.

The state at the first sample is told by the samples after it alone, the velocity ten times worse than within a record. A joint that is in
motion there, in a log that was cut, carries an error of its start along for as long as nothing corrects it. So the start is a draw of
a normal distribution of which the smoother tells the covariance ``P``: with ``S`` what it changes in the whitened innovations, these have
the covariance ``I + S P S'``, by whose root they are divided once more.

References:
    P. de Jong, The likelihood for a state space model, Biometrika 75 (1988) 165-169 (a start of which little is known).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numba
import numpy as np

from bench.arrays import Array
from bench.discrepancy.multibody.joint_record import JointRecord
from bench.discrepancy.multibody.records import PreparedRecord


def whitened(original: JointRecord, record: JointRecord, out: Array, diverged: float) -> Array:
    """Innovations (n, n_measured) in units of their standard deviation, weighted.

    Args:
        original: The joint in a record as it was logged.
        record: The same, its encoder corrected.
        out: (n, 2) innovations.
        diverged: What stands for those that are not finite.
    """
    # a corrected log has another noise; residuals are compared in units of what was logged
    ratio = original.noise / record.noise
    return np.asarray(_whitened(out, original.whitening * ratio, original.weight, diverged))


@numba.njit(cache=True, error_model="numpy", nogil=True)
def _whitened(out: Array, whitening: Array, weight: Array, diverged: float) -> Array:
    """Innovations (n, 2 or less read) times a triangular whitening (k, k) and weights (n, k)."""
    found = np.empty(weight.shape)
    for i in range(weight.shape[0]):
        for k in range(weight.shape[1]):
            total = 0.0
            for m in range(k + 1):
                total += whitening[k, m] * out[i, m]
            total *= weight[i, k]
            if not math.isfinite(total):
                total = diverged if math.isnan(total) else math.copysign(diverged, total)
            found[i, k] = total
    return found


def softened(prepared: PreparedRecord, level: float) -> PreparedRecord:
    """A record with torque noise of at least `level` times the RMS torque where no servo holds a joint, which lets its runs listen more."""
    joints = []
    for record in prepared.joints:
        drive = record.joint.drive
        free = drive is not None and not drive.servo
        torque = level * float(np.std(record.command)) * abs(drive.gear * drive.kp) if free else 0.0
        joints.append(replace(record, process=torque, filter=None) if torque > record.process else record)
    return replace(prepared, joints=tuple(joints))


class UnknownStart(NamedTuple):
    """What is not known of the start of a joint in a record.

    Attributes:
        directions: (n n_measured, k) orthonormal changes of the innovations.
        kept: (k,) what counts of an amplitude along each.
    """

    directions: Array
    kept: Array

    @classmethod
    def of(cls, record: JointRecord, innovations: Callable[[Array], Array]) -> UnknownStart:
        """What is not known of a start.

        Args:
            record: The joint in a record.
            innovations: Takes a start (2,) to the whitened innovations (n, n_measured).
        """
        values, axes = np.linalg.eigh(record.start_covariance)
        moves = (axes * np.sqrt(np.maximum(values, 0.0))).T
        rest = innovations(record.start)
        changes = np.column_stack([(innovations(record.start + move) - rest).ravel() for move in moves])
        directions, sizes, _ = np.linalg.svd(changes, full_matrices=False)
        return cls(directions, 1.0 / np.sqrt(1.0 + sizes**2))

    @property
    def log_determinant(self) -> float:
        """Half the logarithm of the determinant of the innovations' covariance: what it costs to know so little."""
        return -float(np.sum(np.log(self.kept)))

    def taken_out(self, found: Array) -> Array:
        """Whitened innovations (n, n_measured) as the unknown start leaves them."""
        along = self.directions.T @ found.ravel()
        return found - (self.directions @ ((1.0 - self.kept) * along)).reshape(found.shape)
