"""What applied verdicts are worth in plain MuJoCo, case by case: the discrepancy there beside that of the diagnosis.

    python scripts/applied.py CASES RESULTS [--only sdof arm2-006 …] [--verdicts FOLDER] [--again] [--json]

CASES holds one folder a case. Cases of an MJCF are taken as they are; those of the rigs "sdof" and "joint" are written as MJCF first, as
their user would have them, and diagnosed as such. RESULTS gets `NAME.json` a case, so that a run can be stopped and taken up again;
verdicts that another run has written as `NAME.json` are read from `--verdicts`, where the case is of an MJCF already. A row holds where the
corrected model in plain MuJoCo, with the model's own step and integrator, leaves what the diagnosis says to within 5 %; where it does not,
the cause is printed: the setting of the simulation that would do, or the form in which an effect could be put in.
"""

from __future__ import annotations

import argparse
import json
import shutil
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from bench.discrepancy import diagnose, read_case
from bench.discrepancy.application.applying import apply
from bench.discrepancy.application.reading import findings_of, gaps_left, read_verdict
from bench.discrepancy.replay.verification import VerificationSettings, is_articulated, verify
from bench.errors import BenchError
from bench.files import json_values, write_text

SDOF = """<mujoco model="sdof">
  <option timestep="0.001" integrator="implicitfast" gravity="0 0 0"/>
  <worldbody><body name="mass">
    <joint name="x" type="slide" axis="1 0 0" stiffness="{stiffness}" damping="{damping}"/>
    <inertial pos="0 0 0" mass="{mass}" diaginertia="0.01 0.01 0.01"/>
  </body></worldbody>
  <actuator><motor name="force" joint="x"/></actuator>
</mujoco>"""
BODY = """<body name="{body}">
    <joint name="x{body}" type="slide" axis="1 0 0" stiffness="{mount_stiffness_axial}" damping="{mount_damping_axial}"/>
    <joint name="theta{body}" type="hinge" axis="1 0 0" stiffness="{mount_stiffness_torsional}" damping="{mount_damping_torsional}"/>
    <inertial pos="0 0 0" mass="{mass}" diaginertia="{inertia} {inertia} {inertia}"/>
  </body>"""
JOINT = """<mujoco model="joint">
  <compiler angle="radian"/>
  <option timestep="0.001" integrator="implicitfast" gravity="0 0 0"/>
  <worldbody>{bodies}</worldbody>
  <tendon>
    <fixed name="axial" stiffness="{k_axial}" damping="{c_axial}" springlength="0">
      <joint joint="x1" coef="-1"/><joint joint="x2" coef="1"/></fixed>
    <fixed name="torsional" stiffness="{k_torsional}" damping="{c_torsional}" springlength="0">
      <joint joint="theta1" coef="-1"/><joint joint="theta2" coef="1"/></fixed>
  </tendon>
  <actuator><motor name="force" joint="x1"/><motor name="torque" joint="theta1"/></actuator>
</mujoco>"""
QUANTITIES = {
    "displacement": ("x", "position"), "velocity": ("x", "velocity"), "acceleration": ("x", "acceleration"),
    "rotation": ("theta", "position"), "angular_velocity": ("theta", "velocity"), "angular_acceleration": ("theta", "acceleration"),
}  # fmt: skip


def as_mjcf(source: Path, folder: Path) -> Path:
    """The case of a rig of the bench as one of an MJCF; another as it is."""
    nominal = json.loads((source / "nominal.json").read_text(encoding="utf-8"))
    if nominal["rig"] not in ("sdof", "joint"):
        return source
    parameters, values = nominal["parameters"], {n: p["value"] for n, p in nominal["parameters"].items()}
    if nominal["rig"] == "sdof":
        text, names = (
            SDOF.format(**values),
            {"mass": "mass:mass", "stiffness": "stiffness:x", "damping": "damping:x"},
        )
    else:
        text, names = _two_bodies(values)
    folder.mkdir(parents=True, exist_ok=True)
    for file in source.iterdir():
        if file.name.startswith(("identification", "validation")):
            shutil.copy(file, folder / file.name)
    (folder / "rig.xml").write_text(text, encoding="utf-8")
    channels = {name: entry | _target(name) for name, entry in nominal["channels"].items()}
    for name in ("force", "torque"):
        if name in channels:
            channels[name].setdefault("role", "measured")
    told = {
        **nominal, "rig": "rig.xml", "channels": channels, "parameters": {names[n]: entry for n, entry in parameters.items()}
    }  # fmt: skip
    (folder / "nominal.json").write_text(json.dumps(told, indent=1), encoding="utf-8")
    return folder


def _two_bodies(values: dict[str, float]) -> tuple[str, dict[str, str]]:
    """MJCF of two bodies and a joint, and what its parameters are called there."""
    names, bodies = {}, []
    for body in ("1", "2"):
        own = {n.removesuffix(f"_{body}"): v for n, v in values.items() if n.endswith(f"_{body}")}
        bodies.append(BODY.format(body=body, **own))
        names |= {f"mass_{body}": f"mass:{body}", f"inertia_{body}": f"inertia:{body}"}
        for kind in ("stiffness", "damping"):
            names[f"mount_{kind}_axial_{body}"] = f"{kind}:x{body}"
            names[f"mount_{kind}_torsional_{body}"] = f"{kind}:theta{body}"
    joint = {}
    for axis in ("axial", "torsional"):
        for kind, letter in (("stiffness", "k"), ("damping", "c")):
            joint[f"{letter}_{axis}"] = values[f"joint_{kind}_{axis}"]
            names[f"joint_{kind}_{axis}"] = f"{kind}:{axis}"
    return JOINT.format(bodies="\n  ".join(bodies), **joint), names


def _target(channel: str) -> dict[str, str]:
    """What of the MJCF a channel of a rig of the bench stands for."""
    if channel in ("force", "torque"):
        return {"actuator": channel}
    name, _, body = channel.rpartition("_")
    name, body = (name, body) if body in ("1", "2") else (channel, "")
    if name not in QUANTITIES:
        return {}
    joint, quantity = QUANTITIES[name]
    return {"joint": f"{joint}{body}", "quantity": quantity}


def attempt(source: Path, results: Path, verdicts: Path | None) -> dict[str, Any]:
    """Diagnose a case, or read its verdict, apply it and verify it."""
    began = time.process_time()
    folder = as_mjcf(source, results / "cases" / source.name)
    case = read_case(folder)
    stored = verdicts / f"{source.name}.json" if verdicts is not None and folder == source else None
    if stored is not None and stored.is_file():
        verdict: Any = read_verdict(stored)[1]
    else:
        found = diagnose(case).verdict
        write_text(results / "verdicts" / f"{source.name}.json", json.dumps(found.to_json(), indent=1))
        verdict = found
    findings = findings_of(verdict, nearest=True)
    path = folder / case.rig
    changes = apply(path, findings, case=case, linear=not is_articulated(findings, case)).changes
    worth = verify(path, findings, gaps_left(verdict), case)
    figures = [vars(f) | {"short": f.short} for f in worth.figures]
    off = max(abs(f.short) for f in worth.figures)
    within = off <= (short := VerificationSettings().short)
    # a setting of the simulation explains what is missed only where with it nothing is, but what noise alone leaves
    reached = not worth.remedy or (
        bool(worth.better) and all(f.short <= short or f.after <= f.floor for f in worth.better)
    )
    causes = [worth.remedy, worth.less, worth.simulator_line]
    causes += [
        f"{c.what}: {c.text}" for c in changes if c.form in ("step", "log", "none") or "diagnosis" in c.text
    ]
    return {
        "case": source.name, "verdict": verdict.verdict, "named": [e.name for e in findings.effects],
        "forms": sorted({c.form for c in changes if c.form != "number"}), "line": worth.line, "figures": figures, "off": off,
        "within": within, "reached": reached, "cause": "" if within else "; ".join(filter(None, causes)),
        "seconds": time.process_time() - began,
    }  # fmt: skip


def told(row: dict[str, Any]) -> str:
    """A row as a line or two."""
    if "error" in row:
        return f"{row['case']:12s} {row['error']}"
    words = (
        "within 5 %" if row["within"] else f"{100 * row['off']:.0f} % off: {row['cause'] or 'no cause known'}"
    )
    return f"{row['case']:12s} {' + '.join(row['named']) or row['verdict']:32s} {row['line']}: {words}"


def chosen(cases: Path, only: Sequence[str]) -> list[Path]:
    """Folders of cases whose names begin with one of some words, in the order of these."""
    folders = sorted(path.parent for path in cases.glob("*/nominal.json"))
    return [folder for start in only for folder in folders if folder.name.startswith(start)]


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("cases", type=Path)
    parser.add_argument("results", type=Path)
    parser.add_argument(
        "--only", nargs="*", default=[""], help="beginnings of names, in the order in which they are run"
    )
    parser.add_argument("--verdicts", type=Path, help="folder of verdicts that are there already")
    parser.add_argument("--again", action="store_true", help="cases that have a result, too")
    parser.add_argument("--json", action="store_true", help="print JSON")
    asked = parser.parse_args()
    (asked.results / "verdicts").mkdir(parents=True, exist_ok=True)
    rows = []
    for folder in chosen(asked.cases, asked.only):
        store = asked.results / f"{folder.name}.json"
        if store.is_file() and not asked.again:
            rows.append(json.loads(store.read_text(encoding="utf-8")))
        else:
            try:
                rows.append(attempt(folder, asked.results, asked.verdicts))
            except BenchError as error:
                rows.append({"case": folder.name, "error": " ".join(str(error).split())})
            write_text(store, json.dumps(json_values(rows[-1]), indent=1))
        if not asked.json:
            print(told(rows[-1]), flush=True)
    tried = [row for row in rows if "error" not in row]
    summary = {
        "n": len(tried), "refused": len(rows) - len(tried), "within": sum(row["within"] for row in tried),
        "explained": sum(not row["within"] and row["reached"] and bool(row["cause"]) for row in tried),
    }  # fmt: skip
    if asked.json:
        print(json.dumps(json_values({**summary, "rows": rows}), indent=1))
    else:
        print(
            "{within} of {n} within 5 %, {explained} with its whole cause, {refused} refused".format(
                **summary
            )
        )


if __name__ == "__main__":
    main()
