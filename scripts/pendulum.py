"""Friction, stops and drag on a pendulum that swings far, found beside a nominal model of which gravity is a part.

    python scripts/pendulum.py [--json] [--repeats 3]

A motor turns an arm with a weight on it, up to 50 to 85 degrees, as on a test bench for drives. MuJoCo makes the records, in steps of
0.1 ms with the missing force as a native callback, mass and damping off by their uncertainty, noise on torque and angle. The
diagnosis sees the MJCF without that force, two records, and nothing else. Printed is how often it names just what was missing, how
often it finds something where nothing was, and how far the gap on the second record is from its noise floor.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from bench.arrays import Array
from bench.discrepancy import diagnose_folder
from bench.rig import Element, Rig, simulate

RATE, DURATION, STEP = 500.0, 16.0, 1e-4
TORQUE_NOISE, ANGLE_NOISE = 2e-3, 1e-3
MASS, DAMPING = (0.5, 0.01), (0.012, 0.003)
"""Nominal value and uncertainty [kg, N m s/rad]."""
ANGLES = (50.0, 85.0)
"""Smallest and largest peak of the swing [degrees]."""
MODEL = """<mujoco model="pendulum">
  <option gravity="0 0 -9.81" timestep="{step}" integrator="RK4"><flag contact="disable"/></option>
  <worldbody><body name="arm">
    <joint name="hinge" type="hinge" axis="0 1 0" damping="{damping}" armature="0.003"/>
    <inertial pos="0 0 -0.15" mass="{mass}" diaginertia="0.0005 0.0005 0.0005"/>
  </body></worldbody>
  <actuator><motor name="motor" joint="hinge"/></actuator>
  <sensor><jointpos name="angle" joint="hinge"/></sensor>
</mujoco>"""


class Kind(NamedTuple):
    """A force that the nominal model lacks.

    Attributes:
        law: Law of the bench; empty for none.
        theta: Smallest and largest value of each of its parameters.
        name: What the diagnosis calls it.
    """

    law: str
    theta: tuple[tuple[float, float], ...]
    name: str


KINDS = (
    Kind("", (), ""),
    Kind("coulomb", ((0.02, 0.06), (2e-3, 2e-3)), "coulomb_friction"),
    Kind("stribeck", ((0.02, 0.05), (0.8, 2.0), (0.3, 0.6), (2e-3, 2e-3)), "stribeck_friction"),
    Kind("quadratic_damping", ((0.002, 0.01),), "quadratic_damping"),
    Kind("gap", ((1.0, 5.0), (0.5, 0.8), (0.0, 0.0), (0.0, 0.0)), "gap"),
)


def torque(peak: float, rig: Rig, rng: np.random.Generator) -> tuple[Array, Array]:
    """Torque and angle at every step, the torque of a size at which the angle reaches its peak [rad]."""
    n = round(DURATION / STEP)
    spectrum = np.fft.rfft(rng.standard_normal(n))
    spectrum[np.fft.rfftfreq(n, STEP) > 4.0] = 0.0
    shape = np.fft.irfft(spectrum, n)
    # straight lines between samples, as the diagnosis takes them
    coarse = round(1.0 / (RATE * STEP))
    samples = np.arange(0, n, coarse)
    shape = np.interp(np.arange(n), samples, shape[samples] / np.std(shape))
    low, high = 0.0, 1.0
    for _ in range(7):
        level = 0.5 * (low + high)
        angle = np.asarray(simulate(rig, {"motor": level * shape})["angle"])
        low, high = (level, high) if np.abs(angle).max() < peak else (low, level)
    return low * shape, np.asarray(simulate(rig, {"motor": low * shape})["angle"])


def measure(folder: Path, kind: Kind, rng: np.random.Generator) -> float:
    """Write a case folder; the largest angle of its records [degrees]."""
    true = {"mass": MASS, "damping": DAMPING}
    values = {name: value + std * float(rng.uniform(-1.5, 1.5)) for name, (value, std) in true.items()}
    rig = Rig("pendulum", MODEL.format(step=STEP, **values), timestep=STEP)
    if kind.law:
        theta = [float(rng.uniform(*limits)) for limits in kind.theta]
        rig = rig.with_element(Element.of(kind.law, "hinge", theta=theta))
    nominal = MODEL.format(step=STEP, mass=MASS[0], damping=DAMPING[0])
    (folder / "pendulum.xml").write_text(nominal, encoding="utf-8")
    parameters = {
        "mass:arm": {"value": MASS[0], "std": MASS[1], "unit": "kg"},
        "damping:hinge": {"value": DAMPING[0], "std": DAMPING[1], "unit": "N m s/rad"},
    }
    channels = {
        "motor": {"unit": "N m", "role": "measured", "noise_std": TORQUE_NOISE},
        "angle": {"unit": "rad", "noise_std": ANGLE_NOISE},
    }
    told = {"rig": "pendulum.xml", "parameters": parameters, "channels": channels}
    (folder / "nominal.json").write_text(json.dumps(told), encoding="utf-8")
    peak, largest = np.radians(rng.uniform(*ANGLES)), 0.0
    every = round(1.0 / (RATE * STEP))
    for name in ("identification", "validation"):
        load, angle = (samples[::every] for samples in torque(float(peak), rig, rng))
        largest = max(largest, float(np.degrees(np.abs(angle).max())))
        columns = [
            np.arange(len(load)) / RATE,
            load + TORQUE_NOISE * rng.standard_normal(len(load)),
            angle + ANGLE_NOISE * rng.standard_normal(len(load)),
        ]
        np.savetxt(
            folder / f"{name}.csv",
            np.column_stack(columns),
            delimiter=",",
            header="time,motor,angle",
            comments="",
        )
    return largest


def run(repeats: int, progress: Callable[[str], None] = lambda text: None) -> dict[str, Any]:
    """Make and diagnose the cases."""
    cases: list[dict[str, Any]] = []
    for k in range(repeats):
        for i, kind in enumerate(KINDS):
            with tempfile.TemporaryDirectory() as name:
                largest = measure(Path(name), kind, np.random.default_rng((20061, k, i)))
                begun = time.perf_counter()
                verdict = diagnose_folder(name).verdict
                seconds = time.perf_counter() - begun
            named = [effect.name for effect in verdict.named]
            sets = [kind.name] if named == [kind.name] else []
            sets += [name for group in verdict.indistinguishable for name in group if set(named) & set(group)]
            right = verdict.verdict == "none" if not kind.law else kind.name in sets and len(named) == 1
            ratio = verdict.gap.after / verdict.gap.noise_floor
            cases.append(
                {
                    "kind": kind.name or "none", "right": right, "named": named, "verdict": verdict.verdict, "degrees": largest,
                    "before": verdict.gap.before, "ratio": ratio, "seconds": seconds,
                }
            )  # fmt: skip
            progress(
                f"{kind.name or 'nothing'}: {verdict.verdict} {' + '.join(named)}, {ratio:.2f} times the floor"
            )
    effects = [case for case in cases if case["kind"] != "none"]
    clean = [case for case in cases if case["kind"] == "none"]
    return {
        "n": len(cases),
        "exact": float(np.mean([case["right"] for case in effects])),
        "false_alarms": float(np.mean([not case["right"] for case in clean])),
        "degrees": float(np.median([case["degrees"] for case in cases])),
        "before": float(np.median([case["before"] for case in effects])),
        "ratio": float(np.median([case["ratio"] for case in effects])),
        "seconds": float(np.median([case["seconds"] for case in cases])),
        "cases": cases,
    }


def main() -> None:
    """Print the scores."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--json", action="store_true", help="print JSON")
    parser.add_argument("--repeats", type=int, default=3, help="cases of each kind")
    args = parser.parse_args()
    told = run(args.repeats, (lambda text: None) if args.json else print)
    if args.json:
        print(json.dumps(told, indent=1))
        return
    print(
        f"{told['n']} cases: {100 * told['exact']:.0f} % of the missing forces named exactly, false alarms "
        f"{100 * told['false_alarms']:.0f} %, gap {told['ratio']:.2f} times its floor, {told['seconds']:.1f} s a case"
    )


if __name__ == "__main__":
    main()
