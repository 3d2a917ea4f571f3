"""Every effect that MJCF has an attribute for: put into a copy of a model, run in MuJoCo, diagnosed, named, applied, closed.

    python scripts/native_effects.py [--only frictionloss range …] [--json] [--out FOLDER]

Two models of one joint, a stage on a spring and an arm on a servo, stand for the user's own. A copy with one attribute changed is
the laboratory: plain MuJoCo with the model's own step, integrator and solver, commands held between samples, noise on what is measured.
The diagnosis sees the model without it, two records and one that judges. What it names is applied to the model, and the judging record
is run in plain MuJoCo once more. What is asked of a row:

- named: the verdict names what was put in and nothing else, alone or as one of a set that the records cannot tell apart;
- applied: it is in the corrected MJCF, in MuJoCo's own terms, without a callback or Python;
- closed: that model, in plain MuJoCo at its own step, leaves of the judging record what the diagnosis says is left, to within 5 %
  (`VerificationSettings.short`). A row that leaves more or less is "explained" where the cause is printed: the setting of the simulation
  that would do, or what the simulator makes otherwise. It is counted apart.

What the diagnosis itself leaves open of the discrepancy beside the noise stands in every row, in per cent.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from mujoco import rollout

from bench.arrays import Array
from bench.discrepancy import diagnose, read_case
from bench.discrepancy.application.applying import apply
from bench.discrepancy.application.reading import findings_of, gaps_left
from bench.discrepancy.replay.verification import VerificationSettings, is_articulated, verify
from bench.discrepancy.verdict import Verdict

Change = Callable[[Any], None]
RECORDS = ("identification", "identification_2", "validation")
RATE, SECONDS = 200.0, 10.0
NOISE = 2e-3
"""Noise of the position over its standard deviation: an encoder of some 500 steps over the motion."""
STAGE = """<mujoco model="stage">
  <option timestep="0.001" integrator="implicitfast" gravity="0 0 0"/>
  <worldbody><body name="table">
    <joint name="guide" type="slide" axis="1 0 0" stiffness="800" damping="6"/>
    <inertial pos="0 0 0" mass="2" diaginertia="0.01 0.01 0.01"/>
  </body></worldbody>
  <actuator><motor name="drive" joint="guide"/></actuator>
</mujoco>"""
ARM = """<mujoco model="arm">
  <option timestep="0.001" integrator="implicitfast"/>
  <worldbody><body name="link">
    <joint name="elbow" type="hinge" axis="0 1 0" damping="0.15" armature="0.01"/>
    <inertial pos="0 0 -0.15" mass="0.6" diaginertia="0.002 0.002 0.0005"/>
  </body></worldbody>
  <actuator><position name="drive" joint="elbow" kp="12" kv="0.3"/></actuator>
</mujoco>"""


@dataclass(frozen=True)
class Model:
    """A user's model, and what is believed of it.

    Attributes:
        text: MJCF.
        joint: Its joint.
        believed: Parameter to relative uncertainty.
        level: RMS of the command [N or rad].
        band: Of the command [Hz].
        units: Of command and position.
    """

    text: str
    joint: str
    believed: dict[str, tuple[float, float]]
    level: float
    band: tuple[float, float]
    units: tuple[str, str]


MODELS = {
    "stage": Model(
        STAGE, "guide", {"mass:table": (2.0, 0.01), "stiffness:guide": (800.0, 0.02), "damping:guide": (6.0, 0.1)},
        12.0, (0.3, 8.0), ("N", "m"),
    ),
    "arm": Model(
        ARM, "elbow", {"mass:link": (0.6, 0.01), "damping:elbow": (0.15, 0.1), "armature:elbow": (0.01, 0.05), "kp:drive": (12.0, 0.02)},
        0.5, (0.2, 4.0), ("rad", "rad"),
    ),
}  # fmt: skip


def joint(**values: Any) -> Change:
    """Attributes of the joint; ``stiffness={2: 5e5}`` sets one entry of a row."""
    return lambda spec: _set(spec.joints[0], values)


def actuator(**values: Any) -> Change:
    """Attributes of the actuator."""
    return lambda spec: _set(spec.actuators[0], values)


def body(**values: Any) -> Change:
    """Attributes of the body."""
    return lambda spec: _set(spec.bodies[1], values)


def _set(item: Any, values: dict[str, Any]) -> None:
    for name, value in values.items():
        if isinstance(value, dict):
            row = np.array(getattr(item, name), dtype=float)
            row[list(value)] = list(value.values())
            setattr(item, name, row)
        else:
            setattr(item, name, value)


@dataclass(frozen=True)
class Native:
    """An attribute of MJCF, and what the diagnosis calls it.

    Attributes:
        model: Name of the model it is put into.
        change: Puts it into a copy.
        called: Names of the effect.
    """

    model: str
    change: Change
    called: tuple[str, ...]


LIMITED = mujoco.mjtLimited.mjLIMITED_TRUE
EFFECTS: dict[str, Native] = {
    "frictionloss": Native("stage", joint(frictionloss=3.0), ("coulomb_friction",)),
    "frictionloss of a servo": Native("arm", joint(frictionloss=0.3), ("coulomb_friction",)),
    "damping": Native("arm", joint(damping={0: 0.5}), ("damping_error",)),
    "damping, quadratic": Native("stage", joint(damping={1: 15.0}), ("quadratic_damping",)),
    "armature": Native("arm", joint(armature=0.03), ("armature_error",)),
    "stiffness": Native("stage", joint(stiffness={0: 900.0}), ("stiffness_error",)),
    "stiffness, quadratic": Native("stage", joint(stiffness={1: 2e3}), ("quadratic_stiffness",)),
    "stiffness, cubic": Native("stage", joint(stiffness={2: 2e5}), ("cubic_stiffness",)),
    "range": Native(
        "stage", joint(range=(-1.0, 0.03), limited=LIMITED, solref_limit=(-2000.0, -3.0)), ("one_sided_stop",)
    ),
    "delay": Native("arm", actuator(delay=0.02, nsample=25, interp=1), ("actuator_delay",)),
    "filter": Native(
        "stage", actuator(dyntype=mujoco.mjtDyn.mjDYN_FILTEREXACT, dynprm={0: 0.02}, actdim=1), ("actuator_lag",)
    ),
    "filter, acting early": Native(
        "stage", actuator(dyntype=mujoco.mjtDyn.mjDYN_FILTEREXACT, dynprm={0: 0.02}, actdim=1, actearly=True), ("actuator_lag",)
    ),
    "filter of a servo": Native(
        "arm", actuator(dyntype=mujoco.mjtDyn.mjDYN_FILTEREXACT, dynprm={0: 0.05}, actdim=1, actearly=True), ("target_lag",)
    ),
    "kp": Native("arm", actuator(gainprm={0: 8.0}, biasprm={1: -8.0}), ("servo_gain_error",)),
    "forcerange": Native("arm", actuator(forcerange=(-6.0, 6.0), forcelimited=LIMITED), ("actuator_saturation",)),
    "gravcomp": Native("arm", body(gravcomp=0.5), ("gravity_compensation",)),
}  # fmt: skip
"""Attribute to where it is tried."""


@dataclass(frozen=True)
class Row:
    """What became of one attribute.

    Attributes:
        effect: The attribute.
        verdict: Kind of the verdict.
        named: Effects that it names.
        right: Whether that is what was put in.
        before: NRMSE of the model in MuJoCo on the judging record.
        diagnosis: What the diagnosis says is left.
        after: NRMSE of the corrected model in MuJoCo.
        floor: NRMSE of noise alone.
        forms: Forms in which what was named is in the model.
        remedy: Cause of the difference between the two, or the setting of the simulation that would do.
        seconds: Processor time of diagnosis and verification.
    """

    effect: str
    verdict: str
    named: tuple[str, ...]
    right: bool
    before: float
    diagnosis: float
    after: float
    floor: float
    forms: tuple[str, ...]
    remedy: str
    seconds: float

    @property
    def applied(self) -> bool:
        """Whether what was named is in the model in MuJoCo's own terms."""
        return set(self.forms) <= {"native", "number"}

    @property
    def closed(self) -> bool:
        """Whether the corrected model leaves what the diagnosis says."""
        return abs(self.after / self.diagnosis - 1.0) <= VerificationSettings().short

    @property
    def left(self) -> float:
        """Part of the discrepancy beside the noise that the diagnosis leaves."""
        beyond = [np.sqrt(max(x**2 - self.floor**2, 0.0)) for x in (self.diagnosis, self.before)]
        return float(beyond[0] / max(beyond[1], 1e-300))

    @property
    def word(self) -> str:
        """How far it came."""
        if not self.right:
            return "not named"
        if not self.applied:
            return "not applied"
        return "closed" if self.closed else "explained" if self.remedy else "open"


def measure(folder: Path, model: Model, change: Change, seed: int = 0) -> None:
    """Write the case: the model as it is believed to be, and records of the copy with the attribute."""
    spec = mujoco.MjSpec.from_string(model.text)
    change(spec)
    real = spec.compile()
    (folder / "model.xml").write_text(model.text, encoding="utf-8")
    every, noise = round(1.0 / (RATE * real.opt.timestep)), 0.0
    for k, name in enumerate(RECORDS):
        rng = np.random.default_rng((seed, k))
        command = model.level * _smooth(rng, model.band)
        control = np.repeat(command, every)[:, None]
        data = mujoco.MjData(real)
        start = np.empty(mujoco.mj_stateSize(real, mujoco.mjtState.mjSTATE_FULLPHYSICS))
        mujoco.mj_getState(real, data, start, mujoco.mjtState.mjSTATE_FULLPHYSICS)
        states, _ = rollout.rollout(real, data, start[None], control[None])
        position = np.concatenate([start[None, 1:2], np.asarray(states)[0, every - 1 : -1 : every, 1:2]])[
            :, 0
        ]
        noise = noise or NOISE * float(np.std(position))
        position = position + noise * rng.standard_normal(len(position))
        table = np.column_stack([np.arange(len(command)) / RATE, command, position])
        np.savetxt(
            folder / f"{name}.csv", table, delimiter=",", header="time,command,position", comments="", fmt="%.9g"
        )  # fmt: skip
    channels = {
        "command": {"unit": model.units[0], "role": "command", "actuator": "drive", "noise_std": 0.0},
        "position": {
            "unit": model.units[1],
            "joint": model.joint,
            "quantity": "position",
            "noise_std": noise,
        },
    }
    parameters = {name: {"value": value, "std": std * value} for name, (value, std) in model.believed.items()}
    told = {
        "rig": "model.xml", "load_interpolation": "zero_order_hold", "parameters": parameters, "channels": channels
    }  # fmt: skip
    (folder / "nominal.json").write_text(json.dumps(told, indent=1), encoding="utf-8")


def _smooth(rng: np.random.Generator, band: tuple[float, float]) -> Array:
    """Random command of RMS one within a band, rising from zero in half a second."""
    n = round(SECONDS * RATE)
    spectrum = np.fft.rfft(rng.standard_normal(n))
    frequency = np.fft.rfftfreq(n, 1.0 / RATE)
    spectrum[(frequency < band[0]) | (frequency > band[1])] = 0.0
    samples = np.fft.irfft(spectrum, n)
    return samples / np.std(samples) * np.minimum(np.arange(n) / (0.5 * RATE), 1.0)


def is_named(verdict: Verdict, called: Sequence[str]) -> bool:
    """Whether a verdict names one effect and no more, itself or within the set that the records cannot tell apart."""
    named = [effect.name for effect in verdict.named]
    alike = {name for group in verdict.indistinguishable if set(named) & set(group) for name in group}
    return verdict.verdict == "effect" and len(named) == 1 and bool({*named, *alike} & set(called))


def attempt(name: str, folder: Path) -> Row:
    """Put one attribute in, diagnose, apply, verify."""
    native, began = EFFECTS[name], time.process_time()
    measure(folder, MODELS[native.model], native.change)
    case = read_case(folder)
    verdict = diagnose(case).verdict
    (folder / "verdict.json").write_text(json.dumps(verdict.to_json(), indent=1), encoding="utf-8")
    found = findings_of(verdict, nearest=True)
    linear = not is_articulated(found, case)
    changes = apply(folder / "model.xml", found, case=case, linear=linear).changes
    worth = verify(folder / "model.xml", found, gaps_left(verdict), case)
    figure = worth.worst
    return Row(
        name, verdict.verdict, tuple(e.name for e in verdict.named), is_named(verdict, native.called), figure.before, figure.diagnosis,
        figure.after, figure.floor, tuple(sorted({c.form for c in changes})), worth.remedy or worth.less, time.process_time() - began,
    )  # fmt: skip


def told(row: Row) -> str:
    """A row as a line."""
    line = (
        f"{row.effect:24s} {' + '.join(row.named) or row.verdict:24s} {row.before:7.3f} -> {row.after:7.4f} "
        f"(diagnosis {row.diagnosis:.4f}, noise {row.floor:.4f}, {100 * row.left:.0f} % left)  {row.word}  {row.seconds:.0f} s"
    )
    return f"{line}\n    {row.remedy}" if row.remedy else line


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--only", nargs="*", choices=EFFECTS, metavar="EFFECT", default=list(EFFECTS))
    parser.add_argument("--json", action="store_true", help="print JSON")
    parser.add_argument("--out", type=Path, help="folder for the cases; a temporary one otherwise")
    asked = parser.parse_args()
    rows = []
    with tempfile.TemporaryDirectory() as temporary:
        for name in asked.only:
            folder = (asked.out or Path(temporary)) / name.replace(" ", "-").replace(",", "")
            folder.mkdir(parents=True, exist_ok=True)
            rows.append(attempt(name, folder))
            if not asked.json:
                print(told(rows[-1]), flush=True)
    counts = Counter(row.word for row in rows)
    if asked.json:
        document = {
            "n": len(rows),
            **counts,
            "rows": [asdict(row) | {"word": row.word, "left": row.left} for row in rows],
        }
        print(json.dumps(document, indent=1))
    else:
        others = "".join(f", {n} {word}" for word, n in counts.items() if word != "closed")
        print(f"{counts['closed']} of {len(rows)} named, applied and closed{others}")


if __name__ == "__main__":
    main()
