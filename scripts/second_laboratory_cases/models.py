"""MJCF of the nominal models."""

from __future__ import annotations

from collections.abc import Callable, Mapping

Values = Mapping[str, float]
"""Nominal values of the parameters, by name."""
Model = Callable[[Values], str]
OPTIONS = 'timestep="0.0005" integrator="RK4"'


def _equal(inertia: float) -> str:
    return f'diaginertia="{inertia:.6g} {inertia:.6g} {inertia:.6g}"'


def _driven(name: str, body: str, joint: str, attributes: str, inertial: str) -> str:
    return f"""<mujoco model="{name}"><option gravity="0 0 0" {OPTIONS}/>
<worldbody><body name="{body}"><joint name="{joint}" {attributes}/>
<inertial pos="0 0 0" {inertial}/></body></worldbody>
<actuator><motor name="drive" joint="{joint}" gear="1"/></actuator></mujoco>
"""


def sliding(name: str, body: str, joint: str, *, spring: bool = True) -> Model:
    """A mass that a motor drives on a slide, with a spring or without."""

    def written(of: Values) -> str:
        stiffness = f' stiffness="{of[f"stiffness:{joint}"]:.6g}"' if spring else ""
        attributes = f'type="slide" axis="1 0 0"{stiffness} damping="{of[f"damping:{joint}"]:.6g}"'
        return _driven(name, body, joint, attributes, f'mass="{of[f"mass:{body}"]:.6g}" {_equal(0.01)}')

    return written


def turning(name: str, body: str, joint: str) -> Model:
    """An inertia that a motor drives on a hinge with a spring."""

    def written(of: Values) -> str:
        stiffness, damping = of[f"stiffness:{joint}"], of[f"damping:{joint}"]
        attributes = f'type="hinge" axis="0 0 1" stiffness="{stiffness:.6g}" damping="{damping:.6g}"'
        return _driven(name, body, joint, attributes, f'mass="1" {_equal(of[f"inertia:{body}"])}')

    return written


def on_table(name: str, body: str, joint: str) -> Model:
    """A mass with an accelerometer on a spring, on a table that slides."""

    def written(of: Values) -> str:
        stiffness, damping = of[f"stiffness:{joint}"], of[f"damping:{joint}"]
        slide = f'type="slide" axis="1 0 0" stiffness="{stiffness:.6g}" damping="{damping:.6g}"'
        table = '<joint name="rail" type="slide" axis="1 0 0"/><inertial pos="0 0 0" mass="80" diaginertia="1 1 1"/>'
        return f"""<mujoco model="{name}"><option gravity="0 0 0" {OPTIONS}/>
<worldbody><body name="table">{table}
<body name="{body}"><joint name="{joint}" {slide}/>
<inertial pos="0 0 0" mass="{of[f"mass:{body}"]:.6g}" {_equal(0.1)}/><site name="top"/></body></body></worldbody>
<sensor><accelerometer name="top_accelerometer" site="top"/></sensor></mujoco>
"""

    return written


def servo(name: str, body: str, joint: str, *, length: float, inertia: float, damping: float) -> Model:
    """A pendulum on a position servo.

    Args:
        name: Of the model.
        body: Of the pendulum.
        joint: Of its hinge.
        length: From the hinge to the centre of mass [m].
        inertia: About the centre of mass [kg m^2].
        damping: Gain of the velocity of the servo [N m s/rad].
    """

    def written(of: Values) -> str:
        hinge = f'type="hinge" axis="0 1 0" damping="{of[f"damping:{joint}"]:.6g}" armature="{of[f"armature:{joint}"]:.6g}"'
        return f"""<mujoco model="{name}"><compiler angle="radian"/><option gravity="0 0 -9.81" {OPTIONS}/>
<worldbody><body name="{body}"><joint name="{joint}" {hinge}/>
<inertial pos="0 0 -{length:.6g}" mass="{of[f"mass:{body}"]:.6g}" {_equal(inertia)}/></body></worldbody>
<actuator><position name="servo" joint="{joint}" kp="{of["kp:servo"]:.6g}" kv="{damping:.6g}"/></actuator></mujoco>
"""

    return written
