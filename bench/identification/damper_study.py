"""The dissertation's damper tests on a synthetic damper: 202 harmonic tests and random tests.

The laboratory records were never published. The damper here is of the same size and is more than any of the fitted models can
hold: a power-law dashpot in series with the spring of fluid and mountings (a Maxwell branch with a nonlinear dashpot, which
remembers), beside it seal friction and a small stiffness, and a moving mass::

    F = m x'' + z + k x + Fc tanh(v / vc),   z' = k1 (v - sgn(z) |z/C|^(1/n))

In slow motion z follows ``C sgn(v)|v|^n``; in fast or random motion it lags, and force over velocity becomes a loop.

What the printed text says, and what it leaves open (our choice in brackets): 202 harmonic tests; limits 2.5 Hz at
0.15 m and 30 Hz at 0.013 m, 48.93 kN; one test named, 0.25 Hz at 0.051 m; statistics of C and n, Tables 3.1 and 3.2. [The
list of tests: amplitudes in half inches from 0.5 to 6 in, frequencies log-uniform from 0.1 Hz and 0.05 m/s, below which
friction rules, to where the actuator, the rated 1.78 m/s or 90 % of the force would be exceeded. The scatter: C and n
of each test drawn from the normal distributions of Table 3.2, independently, within the axes of Fig 3.4; pairs that
reach the limit of force below 0.2 m/s are drawn again. The series spring in proportion to C. Ten periods a test, sensor
noise of 0.5 % of peak.] Random tests of 60 s, peaks 0.0254 and 0.013 m, velocities to 0.08 m/s and forces to 15 kN read off
Figs 3.5 and 3.10. [Flat from 0.1 to 1 Hz.] The start covariance of the on-line polynomial is not given. [20, on columns
scaled to one.]

References:
    Tasbihgoo 2006, chapter 3; Makris, N. and Constantinou, M. C. 1991, Fractional-derivative Maxwell model for viscous dampers,
    J. Struct. Eng. 117 (memory of fluid dampers).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bench.identification.damper_trust import TrustReport, check_design_model
from bench.identification.order_study import OrderStudy as OrderStudy  # noqa: PLC0414  (part of the study)
from bench.identification.order_study import order_study as order_study  # noqa: PLC0414
from bench.laws.base import ForceLaw, Parameter, kernel
from bench.laws.coupling import INCH
from bench.recording import nmse


@dataclass(frozen=True)
class DamperStudySettings:
    """Numbers of `bench.identification.damper_study`."""

    actuator_force: float = 48.93e3
    rated_velocity: float = 1.78
    series_stiffness: float = 70.0
    """Series spring over C: a relaxation time of some 10 to 30 ms at the velocities of the tests."""
    tables: Mapping[tuple[str, str], tuple[float, float]] = field(
        default_factory=lambda: {
            ("on line", "C"): (48.27, 27.52),
            ("on line", "n"): (0.64, 0.20),
            ("least squares", "C"): (59.00, 31.61),
            ("least squares", "n"): (0.71, 0.20),
        }
    )
    """Printed mean and standard deviation, Tables 3.1 and 3.2; C in kN (s/m)^n."""
    printed_nmse: Mapping[str, float] = field(
        default_factory=lambda: {"on line": 4.65, "half amplitude": 11.40, "other segment": 1.40}
    )
    """Printed NMSE of the polynomial model [%], section 3.3."""


DAMPER_STUDY_SETTINGS = DamperStudySettings()


@kernel
def _force(t, q, v, z, theta, f):
    """``f = z + k q + Fc tanh(v / vc)``."""
    f[0] += z[0] + theta[3] * q[0] + theta[4] * math.tanh(v[0] / theta[5])


@kernel
def _rate(t, q, v, z, theta, zdot):
    """``z' = k1 (v - sgn(z) |z/C|^(1/n))``."""
    zdot[0] = theta[2] * (v[0] - math.copysign((abs(z[0]) / theta[0]) ** (1.0 / theta[1]), z[0]))


VISCOUS_DAMPER = ForceLaw(
    name="viscous_damper",
    parameters=(
        Parameter("C", "N", 50e3, (1.0, math.inf), "force of the dashpot at 1 m/s: C in N (s/m)^n"),
        Parameter("n", "1", 0.65, (0.1, 2.0), "velocity exponent of the dashpot"),
        Parameter("series_stiffness", "N/m", 3.5e6, (1.0, math.inf), "spring k1 in series with the dashpot"),
        Parameter("stiffness", "N/m", 1e4, (0.0, math.inf), "spring k beside it"),
        Parameter("friction", "N", 1000.0, (0.0, math.inf), "seal friction Fc"),
        Parameter(
            "regularisation_velocity", "m/s", 2e-3, (1e-9, math.inf), "vc, rounds the friction at rest"
        ),
    ),
    force=_force,
    rate=_rate,
    states=("z [N]",),
    equation="f = z + k q + Fc tanh(v/vc), z' = k1 (v - sgn(z)|z/C|^(1/n))",
    reference="Tasbihgoo 2006, eq. 3.2, in series with a spring",
    smoothness="continuous",
)


class DamperRecord(NamedTuple):
    """A test of the damper under prescribed motion.

    Attributes:
        time: (n,) [s].
        displacement: (n,) [m].
        velocity: (n,) [m/s].
        acceleration: (n,) [m/s²].
        force: Measured force, inertia of the moving mass included (n,) [N].
    """

    time: NDArray[np.float64]
    displacement: NDArray[np.float64]
    velocity: NDArray[np.float64]
    acceleration: NDArray[np.float64]
    force: NDArray[np.float64]

    def part(self, rows: slice) -> DamperRecord:
        """The record cut to some of its samples."""
        return DamperRecord(*(channel[rows] for channel in self))


class PolynomialExperiment(NamedTuple):
    """The polynomial model on random motion (section 3.3.2 and 3.3.3).

    Attributes:
        online: NMSE of the prediction while learning, start included [%]; 4.65 printed.
        half_amplitude: NMSE of the final estimate on another record of half the amplitude [%]; 11.40 printed.
        other_segment: NMSE of the final estimate on another segment of the same record [%]; 1.40 printed.
        batch: NMSE of batch least squares on the training record [%].
        time: (n,) [s].
        theta: Course of the estimates (n, 37), physical units.
        theta_batch: Batch least squares (37,).
        names: Names of the parameters.
        measured: Training force (n,) [N].
        predicted: On-line prediction (n,) [N].
        contributions: ``theta_i phi_i`` with the final estimate (n, 37) [N].
        design: What `check_design_model` says about the same record.
        training: The training record.
        validation_half: The record of half amplitude.
        validation_segment: The other segment.
        predicted_half: Prediction of the half-amplitude record [N].
        predicted_segment: Prediction of the other segment [N].
    """

    online: float
    half_amplitude: float
    other_segment: float
    batch: float
    time: NDArray[np.float64]
    theta: NDArray[np.float64]
    theta_batch: NDArray[np.float64]
    names: tuple[str, ...]
    measured: NDArray[np.float64]
    predicted: NDArray[np.float64]
    contributions: NDArray[np.float64]
    design: TrustReport
    training: DamperRecord
    validation_half: DamperRecord
    validation_segment: DamperRecord
    predicted_half: NDArray[np.float64]
    predicted_segment: NDArray[np.float64]


def damper_record(
    time: ArrayLike,
    displacement: ArrayLike,
    velocity: ArrayLike,
    acceleration: ArrayLike,
    *,
    rng: np.random.Generator,
    mass: float = 20.0,
    noise: float = 0.005,
    **parameters: float,
) -> DamperRecord:
    """Drive the synthetic damper through a motion and measure it.

    Args:
        time: (n,) [s].
        displacement: (n,) [m].
        velocity: (n,) [m/s].
        acceleration: (n,) [m/s²].
        rng: Source of the sensor noise.
        mass: Moving mass between load cell and piston [kg].
        noise: Standard deviation of the noise of force and velocity, as a fraction of their peaks.
        **parameters: Parameters of `VISCOUS_DAMPER`, the rest at their defaults.

    Returns:
        The record.
    """
    from bench.laws.evaluate import evaluate  # noqa: PLC0415  (compiled code, not for every user)

    t, x, v, a = (
        np.asarray(channel, dtype=float) for channel in (time, displacement, velocity, acceleration)
    )
    theta = VISCOUS_DAMPER.theta(**parameters)
    coefficient, exponent, series = theta[:3]
    # Relaxation rate of the branch at the peak speed, where it is fastest for n < 1; RK4 is accurate to 0.1 % at a half.
    rate = series * max(float(np.abs(v).max()), 1e-3) ** (1.0 - exponent) / (exponent * coefficient)
    substeps = max(2, math.ceil(2.0 * rate * float(np.max(np.diff(t)))))
    force = evaluate(VISCOUS_DAMPER, theta, t, x, v, substeps=substeps).force[:, 0] + mass * a
    force = force + noise * np.abs(force).max() * rng.standard_normal(t.size)
    v = v + noise * np.abs(v).max() * rng.standard_normal(t.size)
    return DamperRecord(t, x, v, a, force)


def random_record(
    rng: np.random.Generator,
    *,
    peak: float = INCH,
    seconds: float = 60.0,
    sample_rate: float = 500.0,
    band: tuple[float, float] = (0.1, 1.0),
    **options: float,
) -> DamperRecord:
    """A random test: displacement flat over a band, of a given peak.

    Args:
        rng: Source of motion and noise.
        peak: Largest displacement [m].
        seconds: Duration [s].
        sample_rate: [Hz].
        band: Lowest and highest frequency [Hz].
        **options: For `damper_record`.

    Returns:
        The record.
    """
    n = round(seconds * sample_rate)
    frequency = np.fft.rfftfreq(n, 1.0 / sample_rate)
    inside = (frequency >= band[0]) & (frequency <= band[1])
    spectrum = np.zeros(frequency.size, dtype=complex)
    spectrum[inside] = rng.standard_normal(inside.sum()) + 1j * rng.standard_normal(inside.sum())
    omega = 2j * np.pi * frequency
    motion = [np.fft.irfft(spectrum * omega**k, n) for k in range(3)]
    scale = peak / np.abs(motion[0]).max()
    return damper_record(
        np.arange(n) / sample_rate, *(scale * channel for channel in motion), rng=rng, **options
    )


def harmonic_record(
    frequency: float,
    amplitude: float,
    *,
    rng: np.random.Generator,
    periods: int = 10,
    samples: int = 200,
    **options: float,
) -> DamperRecord:
    """A harmonic test.

    Args:
        frequency: [Hz].
        amplitude: [m].
        rng: Source of the noise.
        periods: Number of periods.
        samples: Samples a period.
        **options: For `damper_record`.

    Returns:
        The record.
    """
    time = np.arange(periods * samples + 1) / (samples * frequency)
    omega = 2.0 * math.pi * frequency
    sine, cosine = np.sin(omega * time), np.cos(omega * time)
    return damper_record(
        time, amplitude * sine, amplitude * omega * cosine, -amplitude * omega**2 * sine, rng=rng, **options
    )


def polynomial_experiment(
    rng: np.random.Generator,
    *,
    orders: tuple[int, int] = (5, 5),
    initial_covariance: float = 20.0,
    peak: float = INCH,
) -> PolynomialExperiment:
    """Identify the polynomial model on line from random motion, and judge it on two other records.

    Args:
        rng: Draws motions and noise.
        orders: Orders in x and v.
        initial_covariance: Of the scaled parameters.
        peak: Largest displacement of the record identified [m]; the other record has half of it.

    Returns:
        The experiment, ready to be plotted.
    """
    from bench.identification.adaptive import AdaptiveLeastSquares  # noqa: PLC0415
    from bench.identification.regressors import Reference, polynomial_model  # noqa: PLC0415

    whole = random_record(rng, peak=peak, seconds=90.0)
    training, segment = whole.part(slice(0, 30_000)), whole.part(slice(30_000, None))
    half = random_record(rng, peak=0.5 * peak)
    peaks = [float(np.abs(channel).max()) for channel in training[1:]]
    model = polynomial_model(*orders, reference=Reference(peaks[3], peaks[0], peaks[1], peaks[2]))
    estimator = AdaptiveLeastSquares(model, initial_covariance=initial_covariance)
    history = estimator.run(
        training.time,
        force=training.force,
        displacement=training.displacement,
        velocity=training.velocity,
        acceleration=training.acceleration,
        keep_regressors=True,
    )
    theta = estimator.theta
    scale = np.array(model.scale)
    columns = _power_columns(training, orders)
    batch = np.linalg.lstsq(columns / scale, training.force)[0] / scale
    predicted = [_power_columns(record, orders) @ theta for record in (half, segment)]
    learnt = np.isfinite(history.measured)
    return PolynomialExperiment(
        online=nmse(history.measured[learnt], history.predicted[learnt]),
        half_amplitude=nmse(half.force, predicted[0]),
        other_segment=nmse(segment.force, predicted[1]),
        batch=nmse(training.force, columns @ batch),
        time=history.time,
        theta=history.theta,
        theta_batch=batch,
        names=model.names,
        measured=training.force,
        predicted=history.predicted,
        contributions=columns * theta,
        design=check_design_model(training.time, training.displacement, training.velocity, training.force),
        training=training,
        validation_half=half,
        validation_segment=segment,
        predicted_half=predicted[0],
        predicted_segment=predicted[1],
    )


def _power_columns(record: DamperRecord, orders: tuple[int, int]) -> NDArray[np.float64]:
    x = record.displacement[:, None] ** np.arange(orders[0] + 1)
    v = record.velocity[:, None] ** np.arange(orders[1] + 1)
    return np.column_stack(
        [record.acceleration, (x[:, :, None] * v[:, None, :]).reshape(record.time.size, -1)]
    )
