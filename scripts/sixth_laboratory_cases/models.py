"""MJCF models of the rigs that no rig of the bench describes, as their engineers have them."""

from __future__ import annotations

STAGE = """<mujoco model="linear motor stage">
  <option timestep="0.001"/>
  <worldbody>
    <body name="carriage">
      <joint name="rail" type="slide" axis="1 0 0" damping="14"/>
      <geom type="box" size="0.09 0.06 0.02" mass="3.2"/>
    </body>
  </worldbody>
  <actuator>
    <motor name="motor" joint="rail"/>
  </actuator>
</mujoco>
"""

ROTOR = """<mujoco model="shaft with a fan disc, vertical">
  <option timestep="0.001"/>
  <worldbody>
    <body name="disc">
      <inertial pos="0 0 0" mass="4.1" diaginertia="0.026 0.026 0.05"/>
      <joint name="shaft" type="hinge" axis="0 0 1" damping="0.0042"/>
      <geom type="cylinder" size="0.15 0.01" mass="0" contype="0" conaffinity="0"/>
    </body>
  </worldbody>
  <actuator>
    <motor name="drive" joint="shaft"/>
  </actuator>
</mujoco>
"""

PENDULUM = """<mujoco model="pendulum on a knife bearing">
  <option timestep="0.001"/>
  <worldbody>
    <body name="bob">
      <inertial pos="0 0 -0.38" mass="0.62" diaginertia="0.0121 0.0121 0.0008"/>
      <joint name="pivot" type="hinge" axis="0 1 0" damping="0.0006"/>
      <geom type="capsule" fromto="0 0 0 0 0 -0.6" size="0.008" mass="0" contype="0" conaffinity="0"/>
    </body>
  </worldbody>
  <actuator>
    <motor name="hand" joint="pivot"/>
  </actuator>
</mujoco>
"""

FRAME = """<mujoco model="two storeys on a shaking table">
  <option timestep="0.001" gravity="0 0 0"/>
  <worldbody>
    <body name="table">
      <joint name="table" type="slide" axis="1 0 0"/>
      <geom type="box" size="0.3 0.3 0.01" mass="40"/>
      <site name="table_site"/>
      <body name="floor_1" pos="0 0 0.3">
        <joint name="storey_1" type="slide" axis="1 0 0" stiffness="5200" damping="11"/>
        <geom type="box" size="0.15 0.15 0.01" mass="4.5"/>
        <site name="floor_1_site"/>
        <body name="floor_2" pos="0 0 0.3">
          <joint name="storey_2" type="slide" axis="1 0 0" stiffness="4300" damping="8"/>
          <geom type="box" size="0.15 0.15 0.01" mass="3.8"/>
          <site name="floor_2_site"/>
        </body>
      </body>
    </body>
  </worldbody>
  <sensor>
    <accelerometer name="table_acc" site="table_site"/>
    <accelerometer name="floor_1_acc" site="floor_1_site"/>
    <accelerometer name="floor_2_acc" site="floor_2_site"/>
  </sensor>
</mujoco>
"""

FLOOR = """<mujoco model="floor strip with a machine on mounts">
  <option timestep="0.001" gravity="0 0 0"/>
  <worldbody>
    <body name="strip">
      <joint name="floor" type="slide" axis="0 0 1" stiffness="312000" damping="480"/>
      <geom type="box" size="0.6 0.3 0.05" mass="120"/>
      <site name="strip_site"/>
      <body name="machine" pos="0 0 0.3">
        <joint name="mount" type="slide" axis="0 0 1" stiffness="148000" damping="95"/>
        <geom type="box" size="0.15 0.15 0.15" mass="21"/>
        <site name="machine_site"/>
      </body>
    </body>
  </worldbody>
  <actuator>
    <motor name="shaker" joint="floor"/>
  </actuator>
  <sensor>
    <accelerometer name="strip_acc" site="strip_site"/>
    <accelerometer name="machine_acc" site="machine_site"/>
  </sensor>
</mujoco>
"""
