"""MJCF of the nominal models."""

from __future__ import annotations

SEAT = """<mujoco model="seat">
  <option gravity="0 0 0" timestep="0.001" integrator="RK4"/>
  <worldbody>
    <body name="platform">
      <joint name="floor" type="slide" axis="0 0 1"/>
      <inertial pos="0 0 0" mass="180" diaginertia="20 20 20"/>
      <body name="seat" pos="0 0 0.45">
        <joint name="suspension" type="slide" axis="0 0 1" stiffness="6500" damping="180"/>
        <inertial pos="0 0 0" mass="55" diaginertia="2 2 2"/>
        <site name="cushion"/>
      </body>
    </body>
  </worldbody>
  <sensor>
    <accelerometer name="cushion_accelerometer" site="cushion"/>
  </sensor>
</mujoco>
"""
"""A seat on its suspension, on a platform that moves."""
DRIVELINE = """<mujoco model="driveline">
  <compiler angle="radian"/>
  <option gravity="0 0 0" timestep="0.0005" integrator="RK4"/>
  <worldbody>
    <body name="flywheel">
      <joint name="bearing" type="hinge" axis="0 0 1" stiffness="310" damping="0.6"/>
      <inertial pos="0 0 0" mass="6.1" diaginertia="0.03 0.03 0.052"/>
      <body name="brake_disc" pos="0 0 0.4">
        <joint name="coupling" type="hinge" axis="0 0 1" stiffness="240" damping="0.35"/>
        <inertial pos="0 0 0" mass="3.4" diaginertia="0.02 0.02 0.031"/>
      </body>
    </body>
  </worldbody>
  <actuator>
    <motor name="torque_motor" joint="bearing"/>
  </actuator>
</mujoco>
"""
"""A flywheel on a bearing and a brake disc behind a coupling."""
PENDULUM = """<mujoco model="pendulum">
  <compiler angle="radian"/>
  <option gravity="0 0 -9.81" timestep="0.002" integrator="RK4"/>
  <worldbody>
    <body name="bob" pos="0 0 1">
      <joint name="pivot" type="hinge" axis="0 1 0" damping="0.03"/>
      <inertial pos="0 0 -0.3" mass="2.6" diaginertia="0.02 0.02 0.004"/>
    </body>
  </worldbody>
  <actuator>
    <motor name="nothing" joint="pivot"/>
  </actuator>
</mujoco>
"""
"""A pendulum whose motor does nothing."""
