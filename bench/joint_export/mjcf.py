"""An identified joint in an MJCF model: in MuJoCo's own terms where it has them exactly, otherwise as a native callback."""

from __future__ import annotations

from pathlib import Path
from types import MappingProxyType

from bench.discrepancy.application.applying import Applied, Findings, apply, specification
from bench.discrepancy.application.writing import model_text
from bench.discrepancy.verdict import Estimate, NamedEffect
from bench.errors import ModelError, UnknownNameError
from bench.joint_models.document import JointFile
from bench.laws.registry import find_law

NATIVE = MappingProxyType(
    {
        "gap": "gap",
        "asymmetric_gap": "asymmetric_gap",
        "one_sided_stop": "one_sided_stop",
        "cubic_stiffness": "cubic_stiffness",
        "quadratic_stiffness": "quadratic_stiffness",
        "quadratic_damping": "quadratic_damping",
        "coulomb": "coulomb_friction",
    }
)
"""Law to the effect that `apply` writes in MuJoCo's own terms."""

_SNIPPET = '''"""'{model}' with its reduced-order joint '{name}' ({kind}, law '{law}') as a native callback. Needs jointbench."""

from pathlib import Path

from bench.rig import Element, Rig
from bench.laws.registry import find_law

LAW = find_law({law!r}, {header})
THETA = LAW.theta({theta})
rig = Rig.from_file(Path(__file__).with_name({model!r}), Element(LAW, {joints}, THETA, name={name!r}))
model = rig.model  # an mujoco.MjModel; step it inside `with bench.native.running(model):`
'''


def model_with(path: Path, joint: JointFile, out: Path) -> tuple[str, str]:
    """The MJCF with the joint in it, and a Python snippet for what MJCF cannot hold, empty where there is nothing.

    Args:
        path: The MJCF.
        joint: The joint.
        out: File that the MJCF is written to.

    Raises:
        ModelError: The MJCF cannot be read.
        UnknownNameError: It lacks a joint.
    """
    own = joint.element
    spec = specification(path)
    known = [item.name for item in (*spec.joints, *spec.tendons) if item.name]
    for place in own.joints:
        if place not in known:
            raise UnknownNameError(f"joint or tendon of '{path.name}'", place, known)
    if own.law.name in NATIVE and len(own.joints) == 1:
        values = {key: Estimate(value, 0.0, "") for key, value in own.parameters.items()}
        effect = NamedEffect(
            NATIVE[own.law.name], own.joints[0], 1.0, values, law=own.law.name, theta=tuple(own.theta)
        )
        applied = apply(path, Findings((effect,)))
        return model_text(applied, out.resolve().parent, path.name), ""
    try:
        spec.compile()
    except ValueError as error:
        raise ModelError(
            f"'{path}' is no MJCF that MuJoCo compiles: {' '.join(str(error).split())}"
        ) from None
    header = tuple(float(x) for x in own.law.header)
    found = find_law(own.law.name, header)
    theta = [float(x) for x in own.theta[len(found.header) :]]
    text = model_text(Applied(spec, (), {}, str(path.parent)), out.resolve().parent, path.name)
    _, _, text = text.partition("-->\n")  # nothing in it was changed
    return text, _SNIPPET.format(
        model=out.name,
        name=own.name,
        kind=joint.kind,
        law=own.law.name,
        header=header,
        theta=theta,
        joints=own.joints,
    )
