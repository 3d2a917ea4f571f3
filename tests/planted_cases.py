"""Cases with a planted effect, integrated here without any code of the diagnosis, for its tests."""

from __future__ import annotations

import math

import numpy as np
from scipy.signal import StateSpace, lsim

from bench.discrepancy import Case, CaseChannel, NominalParameter, record_from_arrays

MASS, STIFFNESS, DAMPING = 2.0, 1800.0, 3.0
BASE_MASS, BASE_STIFFNESS, BASE_DAMPING = 5.0, 15000.0, 15.0
CARRIED_MASS, CARRIED_FREQUENCY, CARRIED_RATIO = 0.5, 9.0, 0.02
SAMPLE_RATE = 500.0
NOISE = {"force": 0.0, "displacement": 1e-4, "acceleration": 0.1}
SUBSTEPS = 3


def load(seed: int, n: int, level: float = 8.0) -> np.ndarray:
    """Random load around the resonance at 4.8 Hz, rising from zero [N]."""
    rng = np.random.default_rng(seed)
    spectrum = np.fft.rfft(rng.standard_normal(n))
    frequency = np.fft.rfftfreq(n, 1.0 / SAMPLE_RATE)
    spectrum[(frequency < 0.5) | (frequency > 12.0)] = 0.0
    samples = np.fft.irfft(spectrum, n) * np.minimum(np.arange(n) / 100.0, 1.0)
    return level * samples / np.std(samples)


def linear_motion(force: np.ndarray, mass=MASS, stiffness=STIFFNESS, damping=DAMPING):
    """Displacement and acceleration under a piecewise linear load, exactly."""
    a = np.array([[0.0, 1.0], [-stiffness / mass, -damping / mass]])
    system = StateSpace(a, [[0.0], [1.0 / mass]], np.eye(2), np.zeros((2, 1)))
    t = np.arange(len(force)) / SAMPLE_RATE
    _, y, _ = lsim(system, force, t)
    return y[:, 0], (force - stiffness * y[:, 0] - damping * y[:, 1]) / mass


def motion_with(force: np.ndarray, effect, hidden: int = 0):
    """Displacement and acceleration with ``effect(x, v, z) -> (force, z')`` added to the spring and damper; classical RK4."""
    h = 1.0 / (SAMPLE_RATE * SUBSTEPS)
    y = [0.0] * (2 + hidden)
    n = len(force)
    x, a = np.zeros(n), np.zeros(n)

    def slope(y, u):
        extra, rates = effect(y[0], y[1], y[2:])
        return [y[1], (u - STIFFNESS * y[0] - DAMPING * y[1] - extra) / MASS, *rates]

    for k in range(n):
        x[k], a[k] = y[0], slope(y, force[k])[1]
        if k == n - 1:
            break
        rise = (force[k + 1] - force[k]) / SUBSTEPS
        for s in range(SUBSTEPS):
            u = force[k] + s * rise
            k1 = slope(y, u)
            k2 = slope([p + 0.5 * h * q for p, q in zip(y, k1, strict=True)], u + 0.5 * rise)
            k3 = slope([p + 0.5 * h * q for p, q in zip(y, k2, strict=True)], u + 0.5 * rise)
            k4 = slope([p + h * q for p, q in zip(y, k3, strict=True)], u + rise)
            y = [
                p + h / 6.0 * (q + 2.0 * (r + s3) + t)
                for p, q, r, s3, t in zip(y, k1, k2, k3, k4, strict=True)
            ]
    return x, a


def planted_case(
    moved=linear_motion, measured=lambda x, a, f: (x, a), *, n=3000, role="measured", noise=NOISE
) -> Case:
    """A case whose motion is `moved(force)` and whose sensors give `measured(x, a, force)`, noise added last."""
    rng = np.random.default_rng(7)
    records = []
    for seed, name in enumerate(("identification", "validation")):
        force = load(seed, n)
        x, a = measured(*moved(force), force)
        values = {
            "force": force,
            "displacement": x + NOISE["displacement"] * rng.standard_normal(n),
            "acceleration": a + NOISE["acceleration"] * rng.standard_normal(n),
        }
        records.append(record_from_arrays(name, np.arange(n) / SAMPLE_RATE, values))
    parameters = (
        NominalParameter("mass", 1.005 * MASS, 0.01 * MASS, "kg"),
        NominalParameter("stiffness", 0.98 * STIFFNESS, 0.03 * STIFFNESS, "N/m"),
        NominalParameter("damping", 1.1 * DAMPING, 0.2 * DAMPING, "N s/m"),
    )
    channels = (
        CaseChannel("force", "N", role, noise["force"]),
        CaseChannel("displacement", "m", "response", noise["displacement"]),
        CaseChannel("acceleration", "m/s^2", "response", noise["acceleration"]),
    )
    return Case("planted", "sdof", parameters, channels, (records[0],), (records[1],))


def bouc_wen_slope(v: float, z: float, A: float, beta: float, gamma: float) -> float:
    """``A v - beta |v| z - gamma v |z|``: Bouc-Wen with n = 1."""
    return A * v - beta * abs(v) * z - gamma * v * abs(z)


def base_motion(force):
    """Motion of the mass when the spring and damper stand on a sprung base; displacement in the room."""
    k, c, m, mb = STIFFNESS, DAMPING, MASS, BASE_MASS
    a = np.array(
        [
            [0, 1, 0, 0],
            [-k / m, -c / m, k / m, c / m],
            [0, 0, 0, 1],
            [k / mb, c / mb, -(k + BASE_STIFFNESS) / mb, -(c + BASE_DAMPING) / mb],
        ]
    )
    system = StateSpace(a, [[0.0], [1.0 / m], [0.0], [0.0]], np.eye(4), np.zeros((4, 1)))
    _, y, _ = lsim(system, force, np.arange(len(force)) / SAMPLE_RATE)
    return y[:, 0], (force - k * (y[:, 0] - y[:, 2]) - c * (y[:, 1] - y[:, 3])) / m


def carried_motion(force):
    """Motion of a mass of which a part stands on a spring of its own."""
    k, c, m, mc = STIFFNESS, DAMPING, MASS - CARRIED_MASS, CARRIED_MASS
    omega = 2.0 * math.pi * CARRIED_FREQUENCY
    kc, cc = mc * omega**2, 2.0 * CARRIED_RATIO * omega * mc
    a = np.array(
        [
            [0, 1, 0, 0],
            [-(k + kc) / m, -(c + cc) / m, kc / m, cc / m],
            [0, 0, 0, 1],
            [kc / mc, cc / mc, -kc / mc, -cc / mc],
        ]
    )
    system = StateSpace(a, [[0.0], [1.0 / m], [0.0], [0.0]], np.eye(4), np.zeros((4, 1)))
    _, y, _ = lsim(system, force, np.arange(len(force)) / SAMPLE_RATE)
    return y[:, 0], y @ a[1] + force / m


def pinched(x, v, z):
    """Slack hysteresis: the slope is small while the force is small, 0.8 at most."""
    A, beta, gamma = 500.0, 150.0, 75.0
    strength = A / (beta + gamma)
    along = z[0] if v >= 0.0 else -z[0]
    h = 1.0 - 0.8 * math.exp(-(((along / strength - 0.1) / 0.33) ** 2))
    return z[0], [h * bouc_wen_slope(v, z[0], A, beta, gamma)]


def degraded(x, v, z):
    """Hysteresis whose strength goes down with the work done on it."""
    nu = 1.0 + 0.8 * z[1]
    return z[0], [bouc_wen_slope(v, z[0], 900.0, 200.0 * nu, 100.0 * nu), z[0] * v]
