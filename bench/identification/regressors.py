"""The models an adaptive estimator can fit: what they are linear in, in which units, and what they leave out.

A model says how ``z = theta^T phi`` is formed from one sample (force, displacement, velocity, acceleration). The compiled
forms are in `bench.identification.stream_models`; here is their description. Reference magnitudes scale z and every column
of phi to the order of one, so that one start covariance suits them all: choose the range of the rig, exactness is of no
importance.

References:
    Tasbihgoo 2006, eqs 2.16, 3.8, 3.11 and section 2.4.1.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bench.errors import ParameterError

KINDS = ("bouc_wen", "sdof", "damper_log", "polynomial", "given")
"""Model kinds in the order of the compiled dispatch."""

CHANNELS = ("force", "displacement", "velocity", "acceleration")


class Reference(NamedTuple):
    """Magnitudes that scale the regressor, in the units of the samples.

    Attributes:
        force: Typical force.
        displacement: Typical displacement.
        velocity: Typical velocity.
        acceleration: Typical acceleration.
    """

    force: float = 1.0
    displacement: float = 1.0
    velocity: float = 1.0
    acceleration: float = 1.0


@dataclass(frozen=True)
class RegressorModel:
    """A model linear in its parameters; build it with one of the functions of this module.

    Attributes:
        kind: One of `KINDS`.
        names: Names of the parameters, in the order of theta.
        terms: What each parameter multiplies, for titles of figures.
        scale: Magnitude of each column of phi (n,).
        force_scale: Magnitude of z.
        orders: Number of powers, or the two orders of a polynomial.
        mass: Moving mass, subtracted as ``F - m a`` by the hysteretic models.
        filter_rate: Rate lambda of the stable filter 1/(s + lambda) [rad/s]; 0 without filter.
        denoise_after: Seconds after which the estimate of r itself, instead of the measured r, enters the nonlinear
            terms; 0 for never (the dissertation's form).
        crossover: Below this [rad/s] the acceleration comes from the velocity channel; 0 for the accelerometer alone.
        floors: Smallest speed and force that enter the logarithmic form.
        uses: Which of `CHANNELS` the model reads.
    """

    kind: str
    names: tuple[str, ...]
    terms: tuple[str, ...]
    scale: tuple[float, ...]
    force_scale: float = 1.0
    orders: tuple[int, int] = (0, 0)
    mass: float = 0.0
    filter_rate: float = 0.0
    denoise_after: float = 0.0
    crossover: float = 0.0
    floors: tuple[float, float] = (0.0, 0.0)
    uses: tuple[bool, bool, bool, bool] = (True, True, True, True)

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise ParameterError(f"regressor kind '{self.kind}' came; one of {', '.join(KINDS)} is expected")
        if not (len(self.names) == len(self.terms) == len(self.scale) >= 1):
            raise ParameterError(
                f"{len(self.names)} names, {len(self.terms)} terms and {len(self.scale)} scales came; "
                "equal numbers are expected"
            )
        for name, values in (("scale", self.scale), ("force_scale", (self.force_scale,))):
            if not all(math.isfinite(value) and value > 0.0 for value in values):
                raise ParameterError(
                    f"{name} {values} came; finite positive magnitudes are expected (see Reference)"
                )
        for name in ("mass", "filter_rate", "denoise_after", "crossover"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0.0):
                raise ParameterError(f"{name} = {value} came; a finite number of at least 0 is expected")

    @property
    def n_parameters(self) -> int:
        """Number of parameters."""
        return len(self.names)

    @property
    def n_filters(self) -> int:
        """Number of filter states the compiled model keeps."""
        return len(self.names) + 3 if self.kind in {"bouc_wen", "sdof"} else 0

    @property
    def to_physical(self) -> NDArray[np.float64]:
        """Factors from scaled to physical parameters (n,)."""
        return self.force_scale / np.array(self.scale)


def _powers(n_powers: int) -> tuple[tuple[str, ...], tuple[str, ...]]:
    if n_powers < 1:
        raise ParameterError(f"n_powers = {n_powers} came; at least one power of the Bouc-Wen law is needed")
    names, terms = [], []
    for n in range(1, n_powers + 1):
        names += [f"-nu beta a{n} / eta", f"nu gamma a{n} / eta"]
        terms += ["|v| r" if n == 1 else f"|v| |r|^{n - 1} r", f"v |r|^{n}" if n > 1 else "v |r|"]
    return tuple(names), tuple(terms)


def _hysteretic_scale(n_powers: int, reference: Reference, rate: float) -> tuple[float, ...]:
    # 1/(s + rate) of a velocity term is of the order of the velocity over the rate.
    return tuple(
        reference.velocity * reference.force**n / rate for n in range(1, n_powers + 1) for _ in range(2)
    )


def _check_filter(filter_rate: float) -> None:
    if not (math.isfinite(filter_rate) and filter_rate > 0.0):
        raise ParameterError(
            f"filter_rate = {filter_rate} rad/s came; the filter 1/(s + lambda) needs a positive rate, "
            "about a third of the system's natural frequency [rad/s]"
        )


def bouc_wen_model(
    n_powers: int = 2,
    *,
    mass: float = 1.0,
    filter_rate: float = 1.0,
    denoise_after: float = 0.0,
    crossover: float = 0.0,
    reference: Reference | None = None,
) -> RegressorModel:
    """Bouc-Wen hysteresis with powers n = 1 … N (eq. 2.16), 1 + 2N parameters.

    ``s/(s+lambda) (F - m a) = theta^T 1/(s+lambda) [v, |v||r|^(n-1) r, v|r|^n, ...]``

    Noise. The measured ``r = F - m a`` stands on both sides, and its noise in the nonlinear terms accumulates in the filter:
    the estimates of a record with 2 % noise on force and acceleration scatter by some 10 % in the weak terms, whatever the
    length of the filter (prefiltering r and v by the same low-pass was tried: it trades this for a bias of the products).
    Two options take the noise out where it enters. With `denoise_after` the estimator's own observer of r, the low-passed r
    plus ``theta^T phi``, replaces r in the nonlinear terms once the estimates have settled (pseudo-linear regression,
    Ljung 1999, section 10.4), and the filter starts quick, so that the first noisy sample is forgotten. With `crossover` the
    acceleration below that frequency is the derivative of the velocity channel, whose noise counts less there. Without noise
    both leave the estimates as they are.

    Args:
        n_powers: N, at least 1.
        mass: Moving mass m (force unit / acceleration unit).
        filter_rate: lambda [rad/s]; a third to a whole of the natural frequency is best under noise.
        denoise_after: Time [s] after which the denoised r is used, one to two system periods; 0 for never.
        crossover: Crossover of the two accelerations [rad/s], some ten times the natural frequency; 0 for none.
        reference: Magnitudes of the samples; ones where None.

    Returns:
        The model with theta = [A/eta, -nu beta a1/eta, nu gamma a1/eta, ...].

    Raises:
        ParameterError: An argument lies outside its range.
    """
    _check_filter(filter_rate)
    reference = reference or Reference()
    names, terms = _powers(n_powers)
    return RegressorModel(
        kind="bouc_wen",
        names=("A / eta", *names),
        terms=("v", *terms),
        scale=(reference.velocity / filter_rate, *_hysteretic_scale(n_powers, reference, filter_rate)),
        force_scale=reference.force,
        orders=(n_powers, 0),
        mass=mass,
        filter_rate=filter_rate,
        denoise_after=denoise_after,
        crossover=crossover,
        uses=(True, False, True, True),
    )


def sdof_model(
    n_powers: int = 2,
    *,
    mass: float = 1.0,
    filter_rate: float = 1.0,
    denoise_after: float = 0.0,
    crossover: float = 0.0,
    reference: Reference | None = None,
) -> RegressorModel:
    """General single-degree-of-freedom model: k, c, d and Bouc-Wen powers (section 2.4.1), 3 + 2N parameters.

    ``s/(s+lambda) (F - m a) = k s/(s+lambda) x + c s/(s+lambda) v + d s/(s+lambda) x^3 + hysteretic terms``

    Args:
        n_powers: N, at least 1; 2 gives the seven parameters of the dissertation.
        mass: Moving mass m (force unit / acceleration unit).
        filter_rate: lambda [rad/s].
        denoise_after: As for `bouc_wen_model`.
        crossover: As for `bouc_wen_model`.
        reference: Magnitudes of the samples; ones where None.

    Returns:
        The model with theta = [k, c, d, -nu beta a1/eta, nu gamma a1/eta, ...].

    Raises:
        ParameterError: An argument lies outside its range.
    """
    _check_filter(filter_rate)
    reference = reference or Reference()
    names, terms = _powers(n_powers)
    return RegressorModel(
        kind="sdof",
        names=("k", "c", "d", *names),
        terms=("x", "v", "x^3", *terms),
        scale=(
            reference.displacement,
            reference.velocity,
            reference.displacement**3,
            *_hysteretic_scale(n_powers, reference, filter_rate),
        ),
        force_scale=reference.force,
        orders=(n_powers, 0),
        mass=mass,
        filter_rate=filter_rate,
        denoise_after=denoise_after,
        crossover=crossover,
    )


def damper_model(*, velocity_floor: float, force_floor: float) -> RegressorModel:
    """Design model ``F = C sgn(v)|v|^n`` in the form ``log|F| = log C + n log|v|`` (eq. 3.8).

    Samples below a floor carry noise only and are passed over, as are those where force and velocity point in opposite
    directions, which the model cannot hold; these are counted (`AdaptiveLeastSquares.out_of_phase`).

    Args:
        velocity_floor: Smallest speed that enters [m/s], a few percent of the peak.
        force_floor: Smallest force that enters [unit of force].

    Returns:
        The model with theta = [log C, n].

    Raises:
        ParameterError: A floor is not positive.
    """
    if not (velocity_floor > 0.0 and force_floor > 0.0):
        raise ParameterError(
            f"floors {velocity_floor}, {force_floor} came; the logarithm needs positive ones, a few percent of the peaks"
        )
    return RegressorModel(
        kind="damper_log",
        names=("log C", "n"),
        terms=("1", "log |v|"),
        scale=(1.0, 1.0),
        floors=(velocity_floor, force_floor),
        uses=(True, False, True, False),
    )


def polynomial_model(order_x: int = 5, order_v: int = 5, *, reference: Reference) -> RegressorModel:
    """Power series ``F = m a + sum a_ij x^i v^j``, i = 0 … k, j = 0 … l (eq. 3.11), 1 + (k+1)(l+1) parameters.

    Args:
        order_x: k.
        order_v: l; k = l = 5 gives the 37 parameters of the dissertation.
        reference: Magnitudes of the samples. Without them the columns differ by many orders of magnitude, and the start
            covariance decides the outcome: about 0.6 of the peaks is good.

    Returns:
        The model with theta = [m, a_00, a_01, ..., a_kl].

    Raises:
        ParameterError: An order is negative.
    """
    if order_x < 0 or order_v < 0:
        raise ParameterError(f"orders {order_x}, {order_v} came; at least 0 is expected")
    pairs = [(i, j) for i in range(order_x + 1) for j in range(order_v + 1)]
    return RegressorModel(
        kind="polynomial",
        names=("m", *(f"a{i}{j}" if max(order_x, order_v) < 10 else f"a{i},{j}" for i, j in pairs)),
        terms=("a", *(f"x^{i} v^{j}" for i, j in pairs)),
        scale=(
            reference.acceleration,
            *(reference.displacement**i * reference.velocity**j for i, j in pairs),
        ),
        force_scale=reference.force,
        orders=(order_x, order_v),
    )


def given_model(
    names: Sequence[str], *, scale: Sequence[float] | None = None, force_scale: float = 1.0
) -> RegressorModel:
    """A model whose z and phi the caller forms (`AdaptiveLeastSquares.update_regressor`, `run_regressors`).

    Args:
        names: Names of the parameters.
        scale: Magnitude of each column (n,); ones where None.
        force_scale: Magnitude of z.

    Returns:
        The model.

    Raises:
        ParameterError: Wrong number of scales, or one that is not positive.
    """
    return RegressorModel(
        kind="given",
        names=tuple(names),
        terms=tuple(names),
        scale=tuple(np.ones(len(names)) if scale is None else map(float, scale)),
        force_scale=force_scale,
    )
