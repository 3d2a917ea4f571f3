"""MJCF of the nominal models."""

from __future__ import annotations

from collections.abc import Callable, Mapping

Values = Mapping[str, float]
"""Nominal values of the parameters, by name, in SI units."""
Model = Callable[[Values], str]
SLIDE, HINGE = 'type="slide" axis="1 0 0"', 'type="hinge" axis="0 0 1"'


def _document(name: str, bodies: str, actuator: str = "") -> str:
    return f"""<mujoco model="{name}"><compiler angle="radian"/><option gravity="0 0 0" timestep="0.0005" integrator="RK4"/>
<worldbody>{bodies}</worldbody>{actuator}</mujoco>
"""


def _motor(name: str, joint: str) -> str:
    return f'\n<actuator><motor name="{name}" joint="{joint}" gear="1"/></actuator>'


def _body(name: str, joint: str, mass: float, inertia: float, *, inner: str = "", place: str = "") -> str:
    diagonal = " ".join([f"{inertia:.6g}"] * 3)
    return f"""<body name="{name}"{place}>{joint}
<inertial pos="0 0 0" mass="{mass:.6g}" diaginertia="{diagonal}"/>{inner}</body>"""


def _sprung(joint: str, kind: str, of: Values) -> str:
    stiffness, damping = of[f"stiffness:{joint}"], of[f"damping:{joint}"]
    return f'<joint name="{joint}" {kind} stiffness="{stiffness:.6g}" damping="{damping:.6g}"/>'


def sliding(body: str, joint: str, motor: str) -> Model:
    """A mass that a motor drives on a slide with a spring."""

    def written(of: Values) -> str:
        moved = _body(body, _sprung(joint, SLIDE, of), of[f"mass:{body}"], 0.01)
        return _document(body, moved, _motor(motor, joint))

    return written


def turning(body: str, joint: str, motor: str) -> Model:
    """An inertia that a motor drives on a hinge with a spring."""

    def written(of: Values) -> str:
        moved = _body(body, _sprung(joint, HINGE, of), 1.0, of[f"inertia:{body}"])
        return _document(body, moved, _motor(motor, joint))

    return written


def turntable(of: Values) -> str:
    """A payload on a flexure, on a table that turns."""
    payload = _body("payload", _sprung("flexure", HINGE, of), 2.0, of["inertia:payload"])
    spindle = f'<joint name="spindle" {HINGE}/>'
    return _document("turntable", _body("turntable", spindle, 30.0, 1.0, inner=f"\n{payload}"))


def frame(of: Values) -> str:
    """Two floors on storeys that shear, the lower one driven by an exciter."""
    upper = _body("floor_2", _sprung("storey_2", SLIDE, of), of["mass:floor_2"], 1.0, place=' pos="0 0 1"')
    lower = _body("floor_1", _sprung("storey_1", SLIDE, of), of["mass:floor_1"], 1.0, inner=f"\n{upper}")
    return _document("frame", lower, _motor("exciter", "storey_1"))
