"""Write cases as a laboratory has them, whose physics is no law of the bench, and what is right of each.

    python scripts/laboratory_like.py out/laboratory-like
    python scripts/measured_cases.py lab_ --cases out/laboratory-like

Rigs are integrated here, apart from the bench (Runge-Kutta of fourth order, ten steps a sample). What is missing is a device
(a magnetorheological damper, a wire rope, rubber), a sensor as it was set up (AC coupled, filtered, clipped, bent), a structure or a
machine (a crack that closes, a beam of two modes, a load behind a belt), or what no catalogue holds (a floor that shakes). Names
that end in ``_unstated`` say nothing of their noise.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import tyro
from scipy.signal import butter, sosfilt

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "scripts"))

from laboratory.machines import machines  # noqa: E402
from laboratory.made import STEP, Made, Rate, case_of, march, multisines, noisy, unstated  # noqa: E402
from laboratory.oscillator import Oscillator  # noqa: E402
from laboratory.structures import second_mode, structures  # noqa: E402

from bench.arrays import Array  # noqa: E402
from bench.discrepancy.blind.protocol import write_case  # noqa: E402
from bench.files import write_text  # noqa: E402


@dataclass(frozen=True)
class Args:
    """Write the cases and their acceptance.json."""

    out: tyro.conf.Positional[Path]
    """Folder for the cases."""
    seed: int = 20261129
    """Of the motions, the loads and the noise."""


def prescribed(
    rng: np.random.Generator,
    name: str,
    force: Callable[[Array, Array], Array],
    parameters: Mapping[str, tuple[float, float, str]],
    right: Sequence[Sequence[str]],
    also: Sequence[str],
    why: str,
) -> Made:
    """A component on a machine that prescribes a sine of 1 Hz and two random motions; its force from displacement and velocity."""
    time = STEP * np.arange(round(12.0 / STEP))
    sine = 0.01 * np.sin(2.0 * np.pi * time) * np.minimum(time, 1.0)
    x = np.column_stack([sine, multisines(rng, 12.0, 0.3, 4.0, (0.006, 0.006))])
    pushed = force(x, np.gradient(x, STEP, axis=0))
    noise = {"displacement": 2e-6, "force": 2.0}
    records = [noisy(rng, {"displacement": x[:, i], "force": pushed[:, i]}, noise) for i in range(x.shape[1])]
    channels = {"displacement": ("m", "prescribed", 2e-6), "force": ("N", "response", 2.0)}
    return Made(f"lab_{name}", case_of(name, "damper", parameters, channels, records), right, also, why)


def hidden(rate: Rate, x: Array, v: Array) -> Array:
    """A hidden state (n_samples, n_records), from zero, along a motion."""
    return march(rate, np.zeros((1, x.shape[1])), np.stack([x, v], axis=1))[:, 0]


def magnetorheological(x: Array, v: Array) -> Array:
    """A Bouc-Wen element beside a dashpot and an accumulator, both behind a second dashpot (Spencer and others, 1997)."""
    alpha, c0, c1, k0, k1 = 33e3, 3300.0, 50e3, 1100.0, 500.0

    def behind(z: Array, y: Array, u: Array) -> Array:
        return (alpha * z + c0 * u[1] + k0 * (u[0] - y)) / (c0 + c1)

    def rate(s: Array, u: Array) -> Array:
        slow = behind(s[0], s[1], u)
        w = u[1] - slow
        return np.array([-1.5e6 * (np.abs(w) * s[0] * np.abs(s[0]) + w * s[0] ** 2) + 90.0 * w, slow])

    inputs = np.stack([x, v], axis=1)
    states = march(rate, np.zeros((2, x.shape[1])), inputs)
    slow = np.array([behind(s[0], s[1], u) for s, u in zip(states, inputs, strict=True)])
    return c1 * slow + k1 * x


def wire_rope(x: Array, v: Array) -> Array:
    """Hysteresis that is stronger under tension, beside a spring that stiffens and is not symmetric."""
    z = hidden(lambda s, u: u[1:2] - 96.0 * np.abs(u[1:2]) * s - 30.0 * u[1:2] * np.abs(s), x, v)
    return 2.2e4 * x + 6e5 * x**2 + 4e7 * x**3 + 5.5e4 * z * np.exp(25.0 * x)


def rubber(x: Array, v: Array) -> Array:
    """Three relaxations and an element that yields, beside a spring."""
    total = 1.5e5 * x
    for stiffness, tau in ((3e4, 0.01), (3e4, 0.05), (3e4, 0.25)):
        total = total + stiffness * hidden(lambda s, u, tau=tau: u[1:2] - s / tau, x, v)
    return total + 8e4 * hidden(lambda s, u: u[1:2] - 500.0 * np.abs(u[1:2]) * s, x, v)


def components(rng: np.random.Generator) -> list[Made]:
    """Components on a machine."""
    memory = (["bouc_wen_hysteresis"], ["presliding_friction"])
    return [
        prescribed(
            rng, "mr_damper", magnetorheological, {"damping": (6000.0, 600.0, "N s/m"), "stiffness": (500.0, 100.0, "N/m")},
            memory, ("damping_error", "stiffness_error"), "a magnetorheological damper; its nominal model is a dashpot",
        ),
        prescribed(
            rng, "wire_rope", wire_rope, {"stiffness": (3e4, 3e3, "N/m"), "damping": (100.0, 50.0, "N s/m")},
            (["bouc_wen_hysteresis", "quadratic_stiffness"],), ("cubic_stiffness", "stiffness_error"),
            "a wire rope isolator: hysteresis, stronger under tension, and a spring that is not symmetric",
        ),
        prescribed(
            rng, "rubber", rubber, {"stiffness": (2e5, 2e4, "N/m"), "damping": (800.0, 400.0, "N s/m")},
            [["viscoelastic_relaxation", *group] for group in memory], ("stiffness_error", "damping_error"),
            "a rubber mount: relaxations and an element that yields",
        ),
        prescribed(
            rng, "hydraulic_damper", lambda x, v: 6e4 * v * np.abs(v) + 120.0 + 800.0 * x,
            {"damping": (3000.0, 1000.0, "N s/m"), "stiffness": (800.0, 80.0, "N/m")},
            (["quadratic_damping", "force_offset"],), ("damping_error",),
            "an orifice with a gas spring; its nominal model has an equivalent dashpot",
        ),
    ]  # fmt: skip


def filtered(x: Array, kind: str, order: int, frequency: float) -> Array:
    """What a filter makes of records (n_samples, n_records)."""
    return np.asarray(sosfilt(butter(order, frequency, kind, fs=1.0 / STEP, output="sos"), x, axis=0))


SENSOR = "nothing is missing from the mechanics: "
OSCILLATORS = (
    Oscillator(
        "ac_coupled", [["acceleration_high_pass"]], SENSOR + "the accelerometer is AC coupled",
        read=lambda x, a: (x, filtered(a, "high", 1, 0.8)), channels=("acceleration",),
    ),
    Oscillator(
        "anti_alias_filter", [["displacement_filter"], ["displacement_delay"], ["displacement_lag"]],
        SENSOR + "the displacement went through a low-pass of second order", read=lambda x, a: (filtered(x, "low", 2, 40.0), a),
    ),
    Oscillator(
        "clipped", [["acceleration_clipping"]], SENSOR + "the accelerometer clips", read=lambda x, a: (x, np.clip(a, -12.0, 12.0)),
    ),
    Oscillator(
        "bent_laser", [["displacement_gain_error"]], SENSOR + "the gain of the displacement grows with it",
        read=lambda x, a: (x + 3.0 * x * np.abs(x), a),
    ),
    Oscillator("mass_of_load_cell", [["mass_error"]], "a mass beyond the load cell was left out", mass=1.6),
    Oscillator(
        "lap_joint", [["bouc_wen_hysteresis"]], "a joint that slips", extra=lambda x, v, z: 900.0 * z,
        memory=lambda v, z: v - np.abs(v) * z * np.abs(z) ** 0.3 / 0.002**1.3,
    ),
    Oscillator(
        "bearing_and_drag", [["coulomb_friction", "quadratic_damping"]], "a bearing's dry friction and drag of the air",
        also=("damping_error", "power_law_damping"), extra=lambda x, v, z: 0.9 * np.tanh(v / 2e-4) + 0.25 * v * np.abs(v),
    ),
    Oscillator(
        "warm_spring", [["record_dependent_stiffness"]], "a spring that is softer in each record", softer=(0.0, 60.0, 120.0),
    ),
    Oscillator("floor", [["timed_force"]], "a floor that shakes from 3 to 6 Hz: a force that no motion tells", shaking=2.5),
)  # fmt: skip


def cases(seed: int, models: Path) -> list[Made]:
    """All cases; models of their own are written to a folder."""
    rng = np.random.default_rng(seed)
    stated = [
        *components(rng),
        *(oscillator.made(rng) for oscillator in OSCILLATORS),
        second_mode(rng, "second_mode", 0.0, [["carried_mass"]], "a second mode near 25 Hz"),
        second_mode(
            rng, "second_mode_and_cubic", 2e6, [["cubic_stiffness", "carried_mass"]], "a cubic spring, and a second mode near 25 Hz"
        ),
        *structures(rng),
        *machines(rng, models),
    ]  # fmt: skip
    return [made for one in stated for made in (one, unstated(one))]


def main() -> int:
    """Write the cases, and last what is right of them."""
    args = tyro.cli(Args, description=__doc__)
    found = cases(args.seed, args.out / "models")
    for made in found:
        write_case(made.case, args.out / made.name)
    entries = {
        made.name: {"right": [list(group) for group in made.right], "also": list(made.also), "why": made.why}
        for made in found
    }
    told = {"written": "with the cases, from what was simulated", "cases": entries}
    write_text(args.out / "acceptance.json", json.dumps(told, indent=1) + "\n")
    print(f"{len(found)} cases in {args.out}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
