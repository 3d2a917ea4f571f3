"""MJCF of the nominal models."""

from __future__ import annotations

from collections.abc import Callable, Mapping

Values = Mapping[str, float]
"""Nominal values of the parameters, by name, in SI units."""
Model = Callable[[Values], str]
ARM = 0.118
"""Distance of the pendulum's centre of mass from its pivot [m]."""


def _sprung(joint: str, kind: str, axis: str, of: Values) -> str:
    stiffness, damping = of[f"stiffness:{joint}"], of[f"damping:{joint}"]
    coefficients = f'stiffness="{stiffness:.6g}" damping="{damping:.6g}"'
    return f'<joint name="{joint}" type="{kind}" axis="{axis}" {coefficients}/>'


def torsion_bar(of: Values) -> str:
    """A disc on a torsion bar, turned by a drive."""
    return f"""<mujoco model="torsion bar with brake behind a coupling">
  <compiler angle="radian"/><option gravity="0 0 0" timestep="0.0005" integrator="RK4"/>
  <worldbody><body name="disc">
    {_sprung("torsion_bar", "hinge", "1 0 0", of)}
    <inertial pos="0 0 0" mass="9" diaginertia="{of["inertia:disc"]:.6g} 0.03 0.03"/></body></worldbody>
  <actuator><motor name="drive" joint="torsion_bar"/></actuator>
</mujoco>
"""


def linear_guide(of: Values) -> str:
    """A carriage on a rail, pushed by a linear motor."""
    return f"""<mujoco model="carriage on a linear guide">
  <option gravity="0 0 0" timestep="0.0005" integrator="RK4"/>
  <worldbody><body name="carriage">
    <joint name="rail" type="slide" axis="1 0 0" damping="{of["damping:rail"]:.6g}"/>
    <inertial pos="0 0 0" mass="{of["mass:carriage"]:.6g}" diaginertia="0.05 0.05 0.05"/></body></worldbody>
  <actuator><motor name="linear_motor" joint="rail"/></actuator>
</mujoco>
"""


def pendulum(of: Values) -> str:
    """A pendulum whose motor does nothing."""
    inertia = of["inertia:pendulum"]
    diagonal = f"{inertia:.6g} {inertia:.6g} {0.6 * inertia:.6g}"
    return f"""<mujoco model="pendulum with a paddle">
  <compiler angle="radian"/><option gravity="0 0 -9.81" timestep="0.0005" integrator="RK4"><flag contact="disable"/></option>
  <worldbody><body name="pendulum">
    <joint name="pivot" type="hinge" axis="0 1 0" damping="{of["damping:pivot"]:.6g}"/>
    <inertial pos="0 0 -{ARM}" mass="{of["mass:pendulum"]:.6g}" diaginertia="{diagonal}"/></body></worldbody>
  <actuator><motor name="pivot_motor" joint="pivot"/></actuator>
</mujoco>
"""


def seat(of: Values) -> str:
    """A seat on its suspension, on a platform that shakes."""
    return f"""<mujoco model="driver's seat on a vertical shaker; x is up, from the static height of ride">
  <option gravity="0 0 0" timestep="0.0005" integrator="RK4"><flag contact="disable"/></option>
  <worldbody><body name="platform">
    <joint name="shaker" type="slide" axis="1 0 0"/>
    <inertial pos="0 0 0" mass="240" diaginertia="9 9 9"/><site name="platform"/>
    <body name="seat" pos="0.4 0 0">
      {_sprung("suspension", "slide", "1 0 0", of)}
      <inertial pos="0 0 0" mass="{of["mass:seat"]:.6g}" diaginertia="3 3 3"/><site name="seat"/></body></body></worldbody>
  <sensor><accelerometer name="platform_acc" site="platform"/><accelerometer name="seat_acc" site="seat"/></sensor>
</mujoco>
"""


def frame(of: Values) -> str:
    """Two storeys, the lower one pushed by a shaker."""
    return f"""<mujoco model="frame with a bolted lap joint">
  <option gravity="0 0 0" timestep="0.0005" integrator="RK4"/>
  <worldbody><body name="lower">
    {_sprung("columns", "slide", "1 0 0", of)}
    <inertial pos="0 0 0" mass="{of["mass:lower"]:.6g}" diaginertia="0.1 0.1 0.1"/><site name="lower"/>
    <body name="upper" pos="0 0 0.5">
      {_sprung("lap", "slide", "1 0 0", of)}
      <inertial pos="0 0 0" mass="{of["mass:upper"]:.6g}" diaginertia="0.1 0.1 0.1"/><site name="upper"/></body></body></worldbody>
  <actuator><motor name="shaker" joint="columns"/></actuator>
  <sensor><accelerometer name="lower_acc" site="lower"/><accelerometer name="upper_acc" site="upper"/></sensor>
</mujoco>
"""


def gear_wheel(of: Values) -> str:
    """A wheel on the springs of its mesh, turned by an exciter."""
    return f"""<mujoco model="wheel of a gear pair, seen from the turning pinion">
  <compiler angle="radian"/><option gravity="0 0 0" timestep="0.00025" integrator="RK4"/>
  <worldbody><body name="wheel">
    {_sprung("mesh", "hinge", "0 0 1", of)}
    <inertial pos="0 0 0" mass="5" diaginertia="0.008 0.008 {of["inertia:wheel"]:.6g}"/></body></worldbody>
  <actuator><motor name="exciter" joint="mesh"/></actuator>
</mujoco>
"""
