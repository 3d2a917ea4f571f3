"""The robots whose records are public: how each is believed to be, and which part of its records finds and which judges."""

from __future__ import annotations

import csv
import re
from collections.abc import Callable, Mapping
from pathlib import Path

import mujoco
import numpy as np

from bench.arrays import Array
from robot_records.case_folders import SPREADS, Axis, Load, Records, cut, table

TURN = 2.0 * np.pi
SO101 = {
    "Rotation": "shoulder_pan", "Pitch": "shoulder_lift", "Elbow": "elbow_flex", "Wrist_Pitch": "wrist_flex",
    "Wrist_Roll": "wrist_roll",
}  # fmt: skip
SO101_FINDING = (
    "friction_gravity", "fast_transitions", "random_waypoints", "workspace_sweep", "single_joint_elbow",
    "single_joint_wrist_pitch", "reach_and_return", "figure_eight", "pick_place", "diagonal_sweep",
)  # fmt: skip
SO101_JUDGING = (
    "boundary_exploration", "hold_under_gravity", "coupled_joints", "square_pattern", "spiral_motion", "chirp_sweep",
    "dual_joint_rotation_pitch", "inertia_coupling", "oscillation_med_freq", "prbs_excitation", "ramp_motion", "sinusoidal_sweep",
    "slow_precision", "triangle_wave", "velocity_ramp",
)  # fmt: skip
LONGEST = 12.0
"""Seconds of a motion that are used: a minute of each would take an hour."""


def short(columns: dict, seconds: float = LONGEST, after: float = 0.0) -> dict:
    """The first seconds of a table, from some time on."""
    t = columns["time"] - columns["time"][0]
    inside = (t >= after) & (t < after + seconds)
    return {name: samples[inside] for name, samples in columns.items()}


def so101(data: Path) -> Records:
    """The SO-101 with the gains of one of its public models; the jaw, whose record is no angle, is held.

    Of a hobby servo little is known: two public models of this arm have gains of 17.8 and 998 N m/rad. But all five are of one type;
    small DC motors of one type differ by some ten percent. Of every motion that is learned from, some seconds find and the next judge.
    """
    folder = data / "so101"
    axes = [
        Axis(joint, f"position_{label}", f"command_{label}", 2e-4, TURN / 4096.0)
        for label, joint in SO101.items()
    ]
    learned = [table(folder / "motions" / f"{name}.parquet") for name in SO101_FINDING]
    return Records(
        (folder / "model_joints_properties.xml").read_text(), axes, [short(one, after=5.0) for one in learned],
        [short(one, after=5.0 + LONGEST) for one in learned], 50.0, True,
        "friction against gravity, play of a degree, a zero that is off; its hand touches the table",
        {"mass": 0.1, "damping": 0.5, "armature": 0.5, "kp": 0.5}, held={"gripper": "hold"},
        further=[short(table(folder / "motions" / f"{n}.parquet"), 1e3, 5.0) for n in SO101_JUDGING],
        servos="STS3215", scatter=0.1,
    )  # fmt: skip


def ur10(data: Path) -> Records:
    """The UR10 with the inertias of its simulator; its only record is smooth to 5 Hz and has no noise of its own."""
    folder = data / "ur10"
    columns = table(folder / "exciting.parquet")
    names = [key.removeprefix("position_") for key in columns if key.startswith("position_")]
    axes = [
        Axis(
            n,
            f"position_{n}",
            f"effort_{n}",
            1e-4,
            velocity=f"velocity_{n}",
            velocity_noise=2e-3,
            torque_noise=0.02,
        )
        for n in names
    ]
    return Records(
        (folder / "model_ursim.xml").read_text(), axes, [cut(columns, 0.02, 0.6)], [cut(columns, 0.6, 0.98)], 125.0, False,
        "Coulomb 12.7, 14.8, 8.3, 2.9, 2.5, 3.0 N m and viscous friction at every joint",
    )  # fmt: skip


def panda(data: Path) -> Records:
    """The Panda without the placeholders of its public model; stale samples left out."""
    folder = data / "panda"
    columns = table(folder / "exciting.parquet")
    names = [key.removeprefix("position_") for key in columns if key.startswith("position_")]
    fresh = np.append(True, np.any([np.diff(columns[f"position_{n}"]) != 0.0 for n in names], axis=0))
    columns = {key: samples[fresh] for key, samples in columns.items()}
    axes = [
        Axis(
            n.removeprefix("fer_"), f"position_{n}", f"effort_{n}", 2e-4, velocity=f"velocity_{n}", velocity_noise=5e-3,
            torque_noise=0.02,
        )
        for n in names
    ]  # fmt: skip
    model = re.sub(r'(damping|armature)="[^"]*"', r'\1="0"', (folder / "model.xml").read_text())
    return Records(
        model, axes, [cut(columns, 0.02, 0.6)], [cut(columns, 0.6, 1.0)], 30.0, False,
        "friction of 0.15 to 0.6 N m, gravity within 2 %",
    )  # fmt: skip


def tx40(data: Path) -> Records:
    """The TX40; torques are motor currents through the gears, in N m."""
    folder = data / "tx40"
    columns = table(folder / "joint_500Hz.parquet")
    axes = [
        Axis(f"joint_{i}", f"position_joint_{i}", f"torque_joint_{i}", 2e-4, torque_noise=0.02)
        for i in range(1, 7)
    ]
    return Records(
        (folder / "model.xml").read_text(), axes, [cut(columns, 0.01, 0.5)], [cut(columns, 0.5, 0.83)], 250.0, False,
        "dry friction 7.1, 8.3, 6.3, 2.5 N m, viscous 8.1, 5.5, 2.0, 1.1 N m s/rad, rotors, a coupled wrist",
    )  # fmt: skip


def _pendulum(
    data: Path,
    model: str,
    finding: tuple[str, ...],
    judging: tuple[str, ...],
    known: str,
    spreads: Mapping[str, float] = SPREADS,
) -> Records:
    """A double pendulum, rigid: damping, friction and armature of its public model set to zero."""
    folder = data / "double_pendulum"
    text = re.sub(r'(damping|frictionloss|armature)="[^"]*"', r'\1="0"', (folder / model).read_text())
    read = {name: table(folder / "runs" / f"{name}.parquet") for name in (*finding, *judging)}
    axes = [
        Axis(
            joint, f"pos_meas{i}", f"tau_meas{i}", 2e-4, 3.8e-4, velocity=f"vel_meas{i}", velocity_noise=0.05, torque_noise=0.02
        )
        for i, joint in ((1, "shoulder"), (2, "elbow"))
    ]  # fmt: skip
    return Records(
        text,
        axes,
        [short(read[n], 8.0) for n in finding],
        [short(read[n], 8.0) for n in judging],
        250.0,
        False,
        known,
        spreads,
    )


def double_pendulum_a0(data: Path) -> Records:
    """Design A.0 by its drawing."""
    known = "Coulomb friction 0.15 and 0.12 N m, rotors of 0.0022 kg m2"
    return _pendulum(
        data, "model_A0_10.xml", ("A0_0815_00", "A0_0815_02", "A0_0815_04"), ("A0_0815_12",), known
    )


def double_pendulum_c1(data: Path) -> Records:
    """Design C.1 by a hypothetical set: its lengths are right, masses and inertias were guessed before it was built."""
    known = "Coulomb friction 0.25 and 0.19 N m"
    return _pendulum(
        data, "model_C0_h10.xml", ("C1_143339", "C1_143601", "C1_143704", "C1_144003"), ("C1_154220",), known,
        {"mass": 0.3, "inertia": 0.3, "com_z": 0.1},
    )  # fmt: skip


def simple_pendulum(data: Path) -> Records:
    """The torque-limited pendulum by its drawing; one run finds in its first part and is judged by the rest.

    Of the others one has spikes for a torque, one was pushed by hand, and in one the pendulum accelerates three times as fast on its way
    down as gravity and its torque can make it.
    """
    folder = data / "simple_pendulum"
    axes = [
        Axis(
            "pivot", "position_measured", "torque_measured", 1e-3, 2.91e-3, velocity="velocity_measured", velocity_noise=0.05,
            torque_noise=0.02,
        )
    ]  # fmt: skip
    read = table(folder / "runs" / "ddp.parquet")
    return Records(
        (folder / "model.xml").read_text(), axes, [cut(read, 0.0, 0.6)], [cut(read, 0.6, 1.0)], 250.0, False,
        "Coulomb friction 0.17 to 0.29 N m; a torque gain of 1.15 or mass",
    )  # fmt: skip


SERVO = """<mujoco><option timestep="0.001"/>
<worldbody><body name="arm"><joint name="servo" axis="0 1 0" armature="{armature}"/>
<inertial pos="0 0 -{length}" mass="{mass}" diaginertia="1e-6 1e-6 1e-6"/></body></worldbody>
<actuator>{drive}</actuator></mujoco>"""


def _servo(
    data: Path,
    runs: tuple[str, ...],
    judging: tuple[str, ...],
    known: str,
    rate: float,
    drive: str,
    spreads: Mapping[str, float],
    **numbers: float,
) -> Records:
    """A servo with a point mass on an arm, for as long as its torque is on."""
    read = {}
    for name in (*runs, *judging):
        columns = table(data / "bam_servos" / "runs" / f"{name}.parquet")
        columns["time"] = columns.pop("timestamp")
        on = int(np.argmin(np.append(columns["torque_enable"], 0.0)))
        read[name] = {key: samples[:on] for key, samples in columns.items()}
    axes = [Axis("servo", "position", "goal_position", 3e-4, TURN / 4096.0)]
    text = SERVO.format(drive=drive, **numbers)
    return Records(
        text, axes, [read[n] for n in runs], [read[n] for n in judging], rate, True, known, spreads
    )


def xl330(data: Path) -> Records:
    """The XL330 at a gain of 400, its voltage in proportion to the position error, K and R as published with the simplest friction.

    The six published fits, one for every model of the friction, have K / R within 13 % of one another and K^2 / R within 11 %.
    """
    constant, resistance, volts, gain = 0.387, 4.02, 7.4, 400.0 * 4096.0 / TURN / (256.0 * 885.0)
    drive = (
        f'<dcmotor name="servo" joint="servo" motorconst="{constant}" resistance="{resistance}" input="pos" '
        f'controller="{constant / resistance * volts * gain} 0 {constant**2 / resistance} 0 0 {volts}"/>'
    )
    return _servo(
        data, ("xl330_kp400_sin_sin", "xl330_kp400_up_and_down"), ("xl330_kp400_sin_time_square",),
        "friction that grows with the torque carried, preferred to Coulomb; a zero of 30 mrad", 190.0, drive,
        {"mass": 0.05, "armature": 0.2, "kp": 0.13, "kv": 0.11, "forcerange": 0.13}, armature=0.0018, mass=0.49, length=0.10,
    )  # fmt: skip


def sts3250(data: Path) -> Records:
    """The STS3250 as a servo of the published stiffness and damping, without its friction."""
    return _servo(
        data, ("sts3250_kp32_sin_sin",), ("sts3250_kp32_lift_and_drop",), "load-dependent friction: 0.2 N m and 0.2 of the load", 49.0,
        '<position name="servo" joint="servo" kp="67.3" kv="2.35"/>', {"mass": 0.05, "armature": 0.2, "kp": 0.13, "kv": 0.11},
        armature=0.001, mass=1.13, length=0.12,
    )  # fmt: skip


BENCH = """<mujoco><option timestep="0.001"/>
<worldbody><body name="lever"><joint name="servo" axis="0 0 1" armature="0.028" damping="0.6"/>
<inertial pos="0.05 0 0" mass="0.03" diaginertia="1e-5 1e-5 1e-5"/></body></worldbody>
<actuator><position name="servo" joint="servo" kp="30"/><motor name="bands" joint="servo"/></actuator></mujoco>"""
BENCH_PULL = 0.29
"""Torque of the bands of the bench, pulled as far as they go [N m]."""


def backlash_bench(data: Path) -> Records:
    """An STS3215 that holds its target while two other servos pull at its lever by bands, in the four stretches between its own moves.

    Rotor and damping are those of a public model of the SO-101, which has this servo; its gain lies between those of two such models.
    How far a band is pulled is what the servo at its other end has moved.
    """
    columns: dict[str, list[float]] = {}
    with (data / "backlash_bench" / "motor_telemetry_single.csv").open(encoding="utf-8") as file:
        for row in csv.DictReader(file):
            if row["pos (5)"]:
                for name, value in row.items():
                    if name.startswith(("pos", "target")):
                        columns.setdefault(name, []).append(float(value))
    counts: dict[str, Array] = {name: np.array(values) for name, values in columns.items()}
    one, other = (
        np.clip((counts[f"pos ({i})"] - rest) / reach, 0.0, 1.0)
        for i, rest, reach in ((3, 1748.0, 394.0), (4, 2347.0, -398.0))
    )
    read: dict[str, Array] = {
        "time": 0.1 * np.arange(len(one), dtype=np.float64),
        "target": (counts["target pos (5)"] - 2047.0) * TURN / 4096.0,
        "position": (counts["pos (5)"] - 2047.0) * TURN / 4096.0,
        "pull": BENCH_PULL * (other - one),
    }
    still = [(17, 64), (81, 128), (145, 192), (209, 256)]
    parts = [{name: samples[low:high] for name, samples in read.items()} for low, high in still]
    return Records(
        BENCH, [Axis("servo", "position", "target", 4e-4, TURN / 4096.0)], parts[:3], parts[3:], 10.0, True,
        "an unloaded dead zone of 7.03 counts, 14.78 under load", {"mass": 0.2, "damping": 0.5, "armature": 0.5, "kp": 0.5},
        loads=[Load("bands", "pull", 0.02 * BENCH_PULL)],
    )  # fmt: skip


def go2_leg(data: Path) -> Records:
    """The left front leg of the Go2, with gains and friction of its repository."""
    folder = data / "go2_air"
    columns = table(folder / "go2_2026-03-19.parquet")
    axes = [
        Axis(f"FL_{part}", f"position_FL_{part}", f"command_FL_{part}", 1e-4, 3e-5) for part in ("hip", "thigh", "calf")
    ]  # fmt: skip
    model = (folder / "model_one_leg_FL.xml").read_text()
    names = [mujoco.MjModel.from_xml_string(model).actuator(u).name for u in range(3)]
    axes = [
        Axis(a.joint, a.position, a.command, a.noise, a.resolution, actuator=n)
        for a, n in zip(axes, names, strict=True)
    ]
    return Records(
        model, axes, [cut(columns, 0.0, 0.55)], [cut(columns, 0.55, 1.0)], 200.0, True,
        "friction, damping and armature; three published identifications differ by a half",
    )  # fmt: skip


ROBOTS: dict[str, Callable[[Path], Records]] = {
    "UR10": ur10, "TX40": tx40, "Panda": panda, "double pendulum A.0": double_pendulum_a0, "double pendulum C.1": double_pendulum_c1,
    "simple pendulum": simple_pendulum, "XL330": xl330, "STS3250": sts3250, "backlash bench": backlash_bench, "Go2 leg": go2_leg,
    "SO-101": so101,
}  # fmt: skip
"""All robots."""
