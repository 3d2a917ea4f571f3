"""The corrected model as files: MJCF with a comment at every change, a snippet for what MJCF cannot hold, ranges for randomisation."""

from __future__ import annotations

import json
import os
import re
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

import mujoco

from bench import native
from bench.discrepancy.application.applying import INTEGRATORS, Applied, Findings
from bench.discrepancy.application.applying import told as one_line
from bench.discrepancy.application.target import Change
from bench.errors import ModelError
from bench.files import replacing, write_text

TAGS = {
    "joint": ("joint", "hinge", "slide"),
    "fixed": ("fixed", "spatial"),
    "body": ("body",),
    "geom": ("geom",),
    "actuator": ("general", "motor", "position", "velocity", "damper", "intvelocity", "dcmotor", "cylinder"),
}
"""Tags that an element of a kind may have in MJCF."""
CARRIED = """
def carried(model, data):
    \"\"\"Torque that the joints carry: of gravity and motion, armature not counted.\"\"\"
    torque = np.zeros(model.nv)
    mujoco.mj_mulM(model, data, torque, data.qacc)
    return torque - model.dof_armature * data.qacc + data.qfrc_bias
"""
"""Part of a snippet for friction that grows with the load."""
WEIGHED = """
def weighed(model, data, dof):
    \"\"\"Of that torque on one joint what its own acceleration does not ask for.\"\"\"
    matrix = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, matrix)
    return carried(model, data)[dof] - (matrix[dof, dof] - model.dof_armature[dof]) * data.qacc[dof]
"""
"""The same for friction in a gear."""


@native.quiet()
def model_text(applied: Applied, folder: Path, source: str) -> str:
    """The corrected MJCF, to stand in a folder; what was changed is said in comments."""
    spec = applied.spec.copy()
    home = Path(applied.folder)
    for kind in ("meshdir", "texturedir"):
        own = getattr(spec, kind, "") or ""
        if not os.path.isabs(own):
            moved = os.path.relpath(home / own, folder)
            if moved != own and (spec.meshes or spec.textures or spec.hfields or spec.skins):
                setattr(spec, kind, moved)
    spec.compile()
    lines = spec.to_xml().splitlines()
    for change in applied.changes:
        for kind, name in change.anchors:
            _annotate(lines, kind, name, change)
    head = [
        f"<!-- {_clean(source)} as corrected by 'jointbench apply':",
        *(_listed(c) for c in applied.changes),
        "-->",
    ]
    return "\n".join([*head, *lines]) + "\n"


def _listed(change: Change) -> str:
    return f"     {_clean(told(change))}"


def _clean(text: str) -> str:
    """Text that may stand in a comment."""
    return re.sub(r"-{2,}", "-", text.replace("->", "to")).rstrip("-")


def _annotate(lines: list[str], kind: str, name: str, change: Change) -> None:
    wanted = re.compile(rf"^(\s*)<({'|'.join(TAGS[kind])})\b[^>]*\bname={re.escape(quoteattr(name))}")
    section = ""
    for at, line in enumerate(lines):
        opened = re.match(r"^\s*<(worldbody|actuator|tendon|sensor|default|equality|contact)\b", line)
        section = opened.group(1) if opened else section
        found = wanted.match(line)
        if found and (section == "actuator") == (kind == "actuator") and section != "default":
            lines.insert(at, f"{found.group(1)}<!-- {_clean(change.what)}: {_clean(change.text)} -->")
            return


@native.quiet()
def write_model(applied: Applied, path: Path, source: str) -> None:
    """Write the corrected MJCF, whole or not at all, once MuJoCo has read it again.

    Raises:
        ModelError: MuJoCo does not read what it wrote.
    """
    text = model_text(applied, path.resolve().parent, source)
    with replacing(path) as temporary:
        temporary.write_text(text, encoding="utf-8")
        try:
            mujoco.MjModel.from_xml_path(str(temporary))
        except ValueError as error:
            raise ModelError(f"MuJoCo does not read the corrected model again: {one_line(error)}") from None


def hook_text(applied: Applied) -> str:
    """Python of the function that runs before every step; empty where there is none."""
    if not applied.lines:
        return ""
    weighed = any("weighed(" in line for line in applied.lines)
    used = CARRIED if weighed or any("carried(" in line for line in applied.lines) else ""
    used += WEIGHED if weighed else ""
    body = "\n".join(f"    {line}" for line in applied.lines)
    return f'{used}\n\ndef before_step(model, data):\n    """Call it before every mujoco.mj_step, controls set."""\n{body}\n'


def snippet(applied: Applied, model: str) -> str:
    """Python that loads the corrected model with what MJCF cannot hold; empty where MJCF holds all.

    Args:
        applied: The corrected model.
        model: Name of its file, beside which the snippet stands.
    """
    hook, elements = hook_text(applied), applied.elements
    if not hook and not elements:
        return ""
    integrator = INTEGRATORS[applied.spec.option.integrator]
    out = ["import math", "from pathlib import Path", "", "import mujoco", "import numpy as np"]
    if elements:
        out += ["", "from bench.rig import Element, Rig", ""]
        out += [
            f"path = Path(__file__).with_name({model!r})",
            f'rig = Rig.from_file(path, integrator="{integrator}")',
        ]
        for e in elements:
            joints = ", ".join(repr(joint) for joint in e.joints)
            theta = [float(x) for x in e.theta]
            out.append(f"rig = rig.with_element(Element.of({e.law.name!r}, {joints}, theta={theta}))")
        out.append(
            "model = rig.model  # a mujoco.MjModel whose passive forces hold the laws, compiled: step it as any other"
        )
    else:
        out += ["", f"model = mujoco.MjModel.from_xml_path(str(Path(__file__).with_name({model!r})))"]
    return "\n".join(out) + "\n" + hook


def write_snippet(applied: Applied, path: Path, model: str) -> None:
    """Write the snippet, whole or not at all."""
    write_text(path, snippet(applied, model))


def ranges(findings: Findings) -> list[dict[str, Any]]:
    """Ranges for domain randomisation: 95 % intervals of what was found and re-estimated, from the posterior."""
    out = [
        {
            "parameter": p.name,
            "mean": p.value,
            "std": p.std,
            "low": p.value - 1.96 * p.std,
            "high": p.value + 1.96 * p.std,
        }
        for p in findings.nominal
    ]
    for effect in findings.effects:
        place = effect.where or effect.channel
        for name, e in effect.parameters.items():
            label = f"{effect.name}:{place}:{name}" if place else f"{effect.name}:{name}"
            out.append({
                "parameter": label, "mean": e.value, "std": e.std, "low": e.value - 1.96 * e.std, "high": e.value + 1.96 * e.std,
                "unit": e.unit,
            })  # fmt: skip
    return out


HOW = (
    "Normal distributions of what the records leave open. mujoco_playground: draw each in the randomize function and write it into the "
    "field of mjx.Model that the corrected MJCF has it in; mjlab: an EventTerm with mdp.randomize_field and these limits; Isaac Lab: "
    "EventTerm with randomize_joint_parameters, randomize_rigid_body_mass or randomize_actuator_gains, operation 'abs'."
)
"""How the ranges are used."""


def ranges_text(findings: Findings, suffix: str) -> str:
    """The ranges as JSON, or as YAML (of which JSON's scalars are a part)."""
    entries = ranges(findings)
    if suffix in (".yaml", ".yml"):
        return f"# {HOW}\nranges:\n" + "".join(_yaml(entry) for entry in entries)
    return json.dumps({"how": HOW, "ranges": entries}, indent=1, ensure_ascii=False, allow_nan=False) + "\n"


def _yaml(entry: dict[str, Any]) -> str:
    rows = [f"{key}: {json.dumps(value, ensure_ascii=False)}" for key, value in entry.items()]
    return "  - " + "\n    ".join(rows) + "\n"


def told(change: Change) -> str:
    """What was done, in a line."""
    where = f" ({change.where})" if change.where and change.where not in change.what else ""
    return f"{change.what}{where} [{change.form}]: {change.text}"
