"""The seven nominal robots.

Sizes are those of machines of the kind, but of no particular product.
"""

from __future__ import annotations

from sixth_robots_cases.robots import Drive, Part, Robot

Z = (0.0, 0.0, 1.0)
Y = (0.0, 1.0, 0.0)
X = (1.0, 0.0, 0.0)
O = (0.0, 0.0, 0.0)  # noqa: E741


def _torque(name: str, kp: float, kd: float) -> Drive:
    return Drive(name, "torque", gains=(kp, kd))


SCARA = Robot(
    "scara",
    (
        Part("upper_arm", "shoulder", Z, (0, 0, 0.4), 3.5, (0.16, 0, 0), (0.008, 0.035, 0.04), 0.15, 1.2,
             _torque("shoulder_motor", 500, 35), 18.0),
        Part("fore_arm", "elbow", Z, (0.3, 0, 0.05), 2.2, (0.12, 0, 0), (0.004, 0.016, 0.018), 0.06, 0.4,
             _torque("elbow_motor", 120, 8), 6.0),
        Part("quill", "lift", Z, (0.25, 0, 0), 0.8, (0, 0, -0.1), (0.003, 0.003, 0.0004), 0.5, 8.0,
             _torque("lift_motor", 1800, 100), 15.0, slide=True),
    ),
)  # fmt: skip
"""A small SCARA arm: two arms by belts, and a quill that lifts; its motors' torques are logged."""

LEG = Robot(
    "leg",
    (
        Part("hip_block", "abduction", X, O, 0.6, (0.0, 0.04, 0.0), (0.0006, 0.0005, 0.0006), 0.006, 0.06,
             _torque("abduction_drive", 60, 1.6), 4.0),
        Part("thigh", "hip", Y, (0, 0.07, 0), 1.0, (0.005, 0.01, -0.07), (0.005, 0.005, 0.0009), 0.006, 0.06,
             _torque("hip_drive", 35, 1.2), 3.2),
        Part("shank", "knee", Y, (0, 0.02, -0.2), 0.25, (0.0, 0.0, -0.1), (0.0011, 0.0011, 0.00005), 0.006, 0.05,
             _torque("knee_drive", 40, 1.0), 2.5),
    ),
)  # fmt: skip
"""A leg of a quadruped on a stand, its trunk held; torques are asked of quasi-direct drives."""


def _hobby(name: str) -> Drive:
    return Drive(name, "position", kp=16.0, kp_std=4.0, limit=4.5, type_="HS30", each=1.2)


DESK = Robot(
    "desk_arm",
    (
        Part("turret", "pan", Z, (0, 0, 0.06), 0.18, (0.0, 0, 0.02), (0.0001, 0.0001, 0.00012), 0.02, 0.5,
             _hobby("pan_servo"), 0.9),
        Part("boom", "lift", Y, (0.02, 0, 0.04), 0.14, (0.06, 0, 0.0), (0.00003, 0.0003, 0.0003), 0.02, 0.5,
             _hobby("lift_servo"), 0.8),
        Part("beam", "elbow", Y, (0.13, 0, 0.0), 0.13, (0.07, 0, 0.0), (0.00003, 0.0003, 0.0003), 0.02, 0.5,
             _hobby("elbow_servo"), 0.7),
        Part("claw", "wrist", Y, (0.12, 0, 0.0), 0.11, (0.04, 0, 0.0), (0.00004, 0.0001, 0.0001), 0.02, 0.5,
             _hobby("wrist_servo"), 0.6),
    ),
    mass_std=0.03,
)  # fmt: skip
"""An arm for a desk on four hobby servos of one type; goals are all that is logged of them."""

CRANE = Robot(
    "camera_crane",
    (
        Part("post", "pan", Z, (0, 0, 1.2), 8.0, (0, 0, 0.05), (0.1, 0.1, 0.08), 1.0, 6.0,
             _torque("pan_motor", 1500, 400), 30.0),
        Part("jib", "boom", Y, (0, 0, 0.15), 12.0, (-0.05, 0, 0.02), (0.08, 8.0, 8.0), 1.5, 8.0,
             _torque("boom_motor", 3000, 600), 60.0),
        Part("head", "tilt", Y, (1.6, 0, -0.1), 4.0, (0.06, 0.0, -0.04), (0.03, 0.035, 0.03), 0.05, 0.4,
             _torque("tilt_motor", 30, 4), 4.0),
    ),
)  # fmt: skip
"""A camera on a jib that is not quite balanced; the currents of its three motors are logged as torques."""

PICK = Robot(
    "pick_head",
    (
        Part("carriage", "gantry", X, (0, 0, 0.5), 5.0, (0, 0, 0), (0.02, 0.03, 0.03), 0.6, 5.0,
             Drive("gantry_motor", "velocity", kv=350.0, kv_std=52.0, gains=(8.0, 0.0)), 32.0, slide=True),
        Part("spindle_slide", "plunge", Z, (0.05, 0, -0.05), 1.2, (0, 0, 0), (0.002, 0.002, 0.001), 0.8, 6.0,
             Drive("plunge_motor", "velocity", kv=300.0, kv_std=45.0, gains=(8.0, 0.0)), 20.0, slide=True),
        Part("nozzle", "turn", Z, (0, 0, -0.06), 0.25, (0.012, 0, -0.02), (0.0001, 0.0001, 0.00008), 0.0006, 0.002,
             Drive("turn_motor", "velocity", kv=0.03, kv_std=0.0045, gains=(8.0, 0.0)), 0.02),
    ),
    damping_std=0.2,
)  # fmt: skip
"""A head that picks and places: a gantry, a plunger and a nozzle that turns, each behind a loop of speed."""

DIGGER = Robot(
    "model_digger",
    (
        Part("boom", "boom_pin", Y, (0.1, 0, 0.3), 9.0, (0.38, 0, 0.05), (0.05, 0.55, 0.55), 1.2, 15.0,
             _torque("boom_jack", 4000, 400), 100.0),
        Part("stick", "stick_pin", Y, (0.8, 0, 0.0), 5.0, (0.2, 0, 0.03), (0.02, 0.13, 0.13), 0.5, 8.0,
             _torque("stick_jack", 1500, 120), 35.0),
        Part("bucket", "bucket_pin", Y, (0.5, 0, 0.0), 3.0, (0.12, 0, -0.04), (0.02, 0.025, 0.025), 0.12, 1.5,
             _torque("bucket_jack", 250, 18), 7.0),
    ),
    mass_std=0.03,
)  # fmt: skip
"""A digger on a scale of one to five with electric jacks, whose torques about the pins are logged."""

WHEEL_LEG = Robot(
    "wheel_leg",
    (
        Part("thigh", "hip", Y, O, 1.2, (0, 0, -0.07), (0.006, 0.006, 0.001), 0.012, 0.1,
             Drive("hip_servo", "position", kp=90.0, kv=2.0, kp_std=18.0, limit=30.0), 5.0),
        Part("shin", "knee", Y, (0, 0.03, -0.2), 0.8, (0, 0, -0.09), (0.004, 0.004, 0.0006), 0.012, 0.1,
             Drive("knee_servo", "position", kp=90.0, kv=1.6, kp_std=18.0, limit=30.0), 3.0),
        Part("rim", "wheel", Y, (0, 0.03, -0.2), 0.9, (0, 0, 0), (0.0025, 0.004, 0.0025), 0.003, 0.01,
             Drive("wheel_drive", "velocity", kv=0.25, kv_std=0.04, gains=(0.0, 0.0)), 0.6),
    ),
)  # fmt: skip
"""A leg with a wheel at its end, in the air on a stand: position servos, and a wheel behind a loop of speed."""
