"""A verdict in the user's own model: effects put into a copy of a small model, run in MuJoCo, applied, closed.

The truth is made in MuJoCo with finer steps, and where MuJoCo has the effect by another road than the one that applies it; the verdict
is written by hand with the true numbers, so that what is left is what applying costs. Nothing here has noise.
"""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

from bench.cli import main
from bench.discrepancy import Case, CaseChannel, record_from_arrays
from bench.discrepancy.application.applying import Findings, RunOptions, apply
from bench.discrepancy.application.forces import not_in_model
from bench.discrepancy.application.reading import findings_of, gaps_left
from bench.discrepancy.application.writing import model_text, ranges, snippet, write_model
from bench.discrepancy.case.case import NominalParameter
from bench.discrepancy.effects.channel_operators import analogue_lag
from bench.discrepancy.effects.channel_operators import lag as digital_lag
from bench.discrepancy.model.model_units import declared_units, in_model_units
from bench.discrepancy.model.rigs import structure_of
from bench.discrepancy.replay.linear_replay import LinearReplay
from bench.discrepancy.replay.verification import verify
from bench.discrepancy.verdict import Estimate, Gap, NamedEffect, NominalEstimate, Verdict

STAGE = """
<mujoco model="stage">
  <option timestep="0.001" integrator="implicitfast" gravity="0 0 0"/>
  <worldbody>
    <body name="table">
      <inertial pos="0 0 0" mass="2" diaginertia="0.01 0.01 0.01"/>
      <joint name="guide" type="slide" axis="1 0 0" stiffness="800" damping="6"/>
      <geom type="box" size="0.1 0.1 0.02" contype="0" conaffinity="0"/>
    </body>
  </worldbody>
  <actuator><motor name="shaker" joint="guide"/></actuator>
  <sensor><jointpos name="displacement" joint="guide"/></sensor>
</mujoco>
"""
ARM = """
<mujoco model="arm">
  <compiler angle="degree"/>
  <option timestep="0.001" integrator="implicitfast"/>
  <default><joint damping="0.3" armature="0.02"/><position kp="40" kv="1.5"/></default>
  <worldbody>
    <body name="upper">
      <joint name="shoulder" type="hinge" axis="0 1 0"/>
      <geom type="capsule" fromto="0 0 0 0.3 0 0" size="0.03" mass="1.2" contype="0" conaffinity="0"/>
      <body name="fore" pos="0.3 0 0">
        <joint name="elbow" type="hinge" axis="0 1 0"/>
        <geom type="capsule" fromto="0 0 0 0.25 0 0" size="0.025" mass="0.7" contype="0" conaffinity="0"/>
        <site name="tip" pos="0.25 0 0"/>
      </body>
    </body>
  </worldbody>
  <actuator><position name="m1" joint="shoulder"/><position name="m2" joint="elbow"/></actuator>
</mujoco>
"""
NAMES = ("identification", "validation")
RATE, FINER = 500.0, 4
"""Sample rate [Hz], and steps of the truth in a step of the model."""


def effect(name: str, where: str = "", channel: str = "", law: str = "", theta=(), **values: Any):
    estimates = {key: Estimate(float(value), 0.01 * abs(value), "") for key, value in values.items()}
    return NamedEffect(
        name, where, 0.99, estimates, channel=channel, equation=name, law=law, theta=tuple(theta)
    )


def smooth(rng, n, low, high, level):
    spectrum = np.fft.rfft(rng.standard_normal(n))
    frequency = np.fft.rfftfreq(n, 1.0 / RATE)
    spectrum[(frequency < low) | (frequency > high)] = 0.0
    samples = np.fft.irfft(spectrum, n)
    return level * samples / np.std(samples) * np.minimum(np.arange(n) / 200.0, 1.0)


def measured(xml, wrong, commands, before_step=None, settle=0):
    """Positions (n, nq) of a model made wrong by `wrong(spec)`, at finer steps, controls along straight lines between samples.

    Without controls for `settle` samples first.
    """
    spec = mujoco.MjSpec.from_string(xml)
    own = float(spec.option.timestep)
    spec.option.timestep = own / FINER
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_RK4
    wrong(spec)
    model = spec.compile()
    data = mujoco.MjData(model)
    n = len(commands)
    per = round(1.0 / RATE / model.opt.timestep)
    fine = np.column_stack([
        np.interp((np.arange(n * per) + 0.5) / per, np.arange(n), column) for column in commands.T
    ])  # fmt: skip
    out = np.empty((n, model.nq))
    for k, row in enumerate(np.concatenate([np.zeros((settle * per, model.nu)), fine]), start=-settle * per):
        if k >= 0 and k % per == 0:
            out[k // per] = data.qpos
        data.ctrl[:] = row
        if before_step is not None:
            before_step(model, data)
        mujoco.mj_step(model, data)
    return out


def stage_case(folder: Path, wrong=lambda spec: None, before_step=None, n=600, level=12.0, noise=0.0) -> Case:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "stage.xml").write_text(STAGE)
    records = []
    for seed, name in enumerate(NAMES):
        force = smooth(np.random.default_rng(seed), n, 0.5, 8.0, level)
        x = measured(STAGE, wrong, force[:, None], before_step)[:, 0]
        x = x + noise * np.random.default_rng(100 + seed).standard_normal(n)
        records.append(record_from_arrays(name, np.arange(n) / RATE, {"shaker": force, "displacement": x}))
    return Case(
        "stage", "stage.xml",
        (NominalParameter("mass:table", 2.0, 0.02), NominalParameter("stiffness:guide", 800.0, 8.0),
         NominalParameter("damping:guide", 6.0, 0.6)),
        (CaseChannel("shaker", "N", "command", None, None, "actuator:shaker"), CaseChannel("displacement", "m", "response", noise or 1e-5)),
        (records[0],), (records[1],), folder,
    )  # fmt: skip


def arm_case(folder: Path, wrong=lambda spec: None, before_step=None, n=600, read=None) -> Case:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "arm.xml").write_text(ARM)
    records = []
    for seed, name in enumerate(NAMES):
        rng = np.random.default_rng(10 + seed)
        target = np.column_stack([smooth(rng, n, 0.2, 2.0, 0.4), smooth(rng, n, 0.2, 2.5, 0.5)])
        q = measured(ARM, wrong, target, before_step, settle=200)
        q = q[:, :2] if read is None else read(q)
        columns = {"t1": target[:, 0], "t2": target[:, 1], "q1": q[:, 0], "q2": q[:, 1]}
        records.append(record_from_arrays(name, np.arange(n) / RATE, columns, at_rest=False))
    channels = (
        CaseChannel("t1", "rad", "command", None, None, "actuator:m1"),
        CaseChannel("t2", "rad", "command", None, None, "actuator:m2"),
        CaseChannel("q1", "rad", "response", 1e-4, None, "joint:shoulder", "position"),
        CaseChannel("q2", "rad", "response", 1e-4, None, "joint:elbow", "position"),
    )
    parameters = (NominalParameter("damping:shoulder", 0.3, 0.03),)
    return Case("arm", "arm.xml", parameters, channels, (records[0],), (records[1],), folder)


def gap_of(dof, after):
    return Gap("NRMSE", 1.0, 1.0, after, after, 0.0, (0.0, 0.0), (), dof)


def friction(joint, level):
    """Hard friction at the finer steps of the truth."""

    def wrong(spec):
        item = spec.joint(joint)
        item.frictionloss = level
        item.solref_friction, item.solimp_friction = (
            (2.1 * spec.option.timestep, 1.0),
            (0.999, 0.999, 0.001, 0.5, 2.0),
        )

    return wrong


def setting(kind, name, **values):
    """Attributes of a joint or an actuator, whole or at an index: ``stiffness=(2, 5e6)``."""

    def wrong(spec):
        item = getattr(spec, kind)(name)
        for key, value in values.items():
            row = value
            if isinstance(value, tuple) and len(value) == 2 and isinstance(value[0], int):
                row = np.array(getattr(item, key), dtype=float)
                row[value[0]] = value[1]
            setattr(item, key, row)

    return wrong


def carrying(mass, frequency, ratio, joint="guide"):
    """The pull of a mass on a spring, whose motion is integrated here."""
    y, omega = np.zeros(2), 2.0 * math.pi * frequency

    def before_step(model, data):
        own = model.joint(joint)
        dof = int(own.dofadr[0])
        if data.time == 0.0:
            y[:] = 0.0
        r, p = y[0] - data.qpos[own.qposadr[0]], y[1] - data.qvel[dof]
        pull = omega**2 * r + 2.0 * ratio * omega * p
        data.qfrc_applied[dof] = mass * pull
        y[1] -= model.opt.timestep * pull
        y[0] += model.opt.timestep * y[1]

    return before_step


def pushed(force, joint="guide"):
    """A force by Python before every step of the truth."""

    def before_step(model, data):
        own = model.joint(joint)
        dof = int(own.dofadr[0])
        data.qfrc_applied[dof] = force(data.time, data.qpos[own.qposadr[0]], data.qvel[dof])

    return before_step


def dead(x, width):
    return math.copysign(max(abs(x) - width, 0.0), x)


def lost(x, width):
    return dead(x, width) - x


def verified(case, effects, dofs=("",), nominal=(), goal=0.02):
    return verify(
        case.folder / case.rig,
        Findings(tuple(effects), tuple(nominal)),
        [gap_of(dof, goal) for dof in dofs],
        case,
    )


# name: what is wrong with the truth, force before its steps, what the verdict says, form
STAGE_EFFECTS = {
    "coulomb_friction": (friction("guide", 3.0), None, effect("coulomb_friction", "guide", friction_force=3.0)),
    "cubic_stiffness": (None, pushed(lambda t, q, v: -2e6 * q**3), effect("cubic_stiffness", k3=2e6)),
    "quadratic_stiffness": (None, pushed(lambda t, q, v: -4e3 * q**2), effect("quadratic_stiffness", k2=4e3)),
    "quadratic_damping": (None, pushed(lambda t, q, v: -60.0 * v * abs(v)), effect("quadratic_damping", "guide", c2=60.0)),
    "gap": (None, pushed(lambda t, q, v: -1500.0 * dead(q, 0.01)), effect("gap", stiffness=1500.0, clearance=0.01)),
    "asymmetric_gap": (
        None,
        pushed(lambda t, q, v: -1500.0 * max(q - 0.01, 0.0) + 700.0 * max(-0.005 - q, 0.0)),
        effect("asymmetric_gap", stiffness_positive=1500.0, stiffness_negative=700.0, clearance_positive=0.01,
               clearance_negative=0.005),
    ),
    "one_sided_stop": (
        None, pushed(lambda t, q, v: 1500.0 * max(-0.006 - q, 0.0)),
        effect("one_sided_stop", stiffness=1500.0, position=-0.006, side=-1.0),
    ),
    "force_offset": (None, pushed(lambda t, q, v: -9.0), effect("force_offset", offset=9.0)),
    "actuator_delay": (
        setting("actuator", "shaker", delay=0.0113, nsample=200, interp=1), None,
        effect("actuator_delay", channel="shaker", delay=0.0113),
    ),
    "actuator_lag": (
        setting("actuator", "shaker", dyntype=mujoco.mjtDyn.mjDYN_FILTEREXACT, dynprm=(0, 0.02)), None,
        effect("actuator_lag", channel="shaker", time_constant=0.02),
    ),
    "force_gain_error": (
        setting("actuator", "shaker", gear=(0, 0.8)), None, effect("force_gain_error", channel="shaker", relative_error=-0.2),
    ),
    "actuator_saturation": (
        setting("actuator", "shaker", ctrlrange=(-8.0, 8.0), ctrllimited=mujoco.mjtLimited.mjLIMITED_TRUE), None,
        effect("actuator_saturation", channel="shaker", level=8.0),
    ),
    "mass_error": (
        setting("body", "table", mass=2.5), None, effect("mass_error", channel="mass:table", relative_error=0.25)
    ),
    "carried_mass": (
        setting("body", "table", mass=1.5), carrying(0.5, 6.0, 0.03), effect("carried_mass", theta=(0.5, 6.0, 0.03), share=0.25)
    ),
    "stribeck_friction": (
        friction("guide", 2.0),
        lambda model, data: model.dof_frictionloss.__setitem__(0, 2.0 * (1.0 + 0.8 * math.exp(-((data.qvel[0] / 0.05) ** 2)))),
        effect("stribeck_friction", "guide", friction_force=2.0, static_excess=0.8, stribeck_velocity=0.05),
    ),
    "cogging": (
        None, pushed(lambda t, q, v: -5.0 * math.sin(2.0 * math.pi * q / 0.02 + 0.4)),
        effect("cogging", law="cogging", theta=(5.0, 0.02, 0.4), sine=1.0),
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", STAGE_EFFECTS)
def test_an_effect_on_a_linear_model_closes_in_plain_mujoco(tmp_path, name):
    wrong, before_step, found = STAGE_EFFECTS[name]
    case = stage_case(tmp_path, wrong or (lambda spec: None), before_step)
    (figure,) = verified(case, [found]).figures
    assert figure.before > 0.08
    assert figure.after < 0.1 * figure.before + 0.005, figure


def test_a_case_in_other_units_is_run_as_it_was_meant(tmp_path):
    """Units of nominal.json are those of its columns, not of MuJoCo."""
    wrong, before_step, found = STAGE_EFFECTS["cubic_stiffness"]
    case = stage_case(tmp_path, wrong or (lambda spec: None), before_step)
    factors = {
        c.name: {"N": ("kN", 1e-3), "m": ("mm", 1e3), "m/s^2": ("g", 1.0 / 9.80665)}[c.unit]
        for c in case.channels
    }

    def scaled(record):
        values = {name: samples * factors[name][1] for name, samples in record.values.items()}
        return replace(record, values=values)

    other = replace(
        case,
        channels=tuple(replace(c, unit=factors[c.name][0]) for c in case.channels),
        identification=tuple(map(scaled, case.identification)),
        validation=tuple(map(scaled, case.validation)),
        options={**case.options, "limits": {"displacement": 8.0}},
    )
    (one,), (same,) = verified(case, [found]).figures, verified(other, [found]).figures
    assert (same.before, same.after) == pytest.approx((one.before, one.after), rel=1e-9)
    converted, said = in_model_units(other)
    assert converted.options["limits"] == {"displacement": pytest.approx(0.008)}
    assert len(said) == len(case.channels)
    assert declared_units(other)["displacement"] == ("mm", pytest.approx(1e-3))


def test_what_follows_a_channel_is_said_not_to_be_in_the_model():
    text = not_in_model([effect("scheduled_coulomb_friction", "guide"), effect("gap", "guide")])
    assert "left to your loop" in text
    assert "gap" not in text


ARM_EFFECTS = {
    "coulomb_friction": (friction("elbow", 1.5), None, effect("coulomb_friction", "elbow", "elbow", limit=1.5)),
    "damping_error": (setting("joint", "elbow", damping=(0, 1.1)), None, effect("damping_error", "elbow", "elbow", added=0.8)),
    "quadratic_damping": (
        None, pushed(lambda t, q, v: -0.3 * v * abs(v), "elbow"), effect("quadratic_damping", "elbow", "elbow", c2=0.3)
    ),
    "armature_error": (setting("joint", "elbow", armature=0.2), None, effect("armature_error", "elbow", "elbow", added=0.18)),
    "actuator_delay": (
        setting("actuator", "m2", delay=0.0207, nsample=400, interp=1), None, effect("actuator_delay", "m2", "elbow", delay_s=0.0207)
    ),
    "target_lag": (
        setting("actuator", "m2", dyntype=mujoco.mjtDyn.mjDYN_FILTEREXACT, dynprm=(0, 0.04), actdim=1), None,
        effect("target_lag", "m2", "elbow", time_constant_s=0.04),
    ),
    "gravity_compensation": (setting("body", "fore", gravcomp=0.9), None, effect("gravity_compensation", "fore", "elbow", share=0.9)),
    "servo_gain_error": (
        setting("actuator", "m2", gainprm=(0, 24.0), biasprm=(1, -24.0)), None,
        effect("servo_gain_error", "m2", "elbow", relative_error=-0.4),
    ),
    "actuator_saturation": (
        setting("actuator", "m2", forcerange=(-1.4, 1.4), forcelimited=mujoco.mjtLimited.mjLIMITED_TRUE), None,
        effect("actuator_saturation", "m2", "elbow", limit=1.4),
    ),
    "one_sided_stop": (
        None, pushed(lambda t, q, v: -min(max(40.0 * (q - 0.3) + 0.5 * v, 0.0), 1e9) * (q > 0.3), "elbow"),
        effect("one_sided_stop", "elbow", "elbow", stiffness=40.0, position=0.3, damping=0.5, side=1.0),
    ),
    "force_offset": (None, pushed(lambda t, q, v: 1.5, "elbow"), effect("force_offset", "elbow", "elbow", force=1.5)),
    "actuator_deadband": (
        None,
        lambda model, data: data.qfrc_applied.__setitem__(1, 40.0 * lost(data.ctrl[1] - data.qpos[1], 0.03)),
        effect("actuator_deadband", "m2", "elbow", half_width=0.03),
    ),
    "load_dependent_friction": (
        friction("elbow", 0.2),
        lambda model, data: model.dof_frictionloss.__setitem__(1, 0.2 + 0.9 * abs(carried(model, data))),
        effect("load_dependent_friction", "elbow", "elbow", limit_0=0.2, mu=0.9),
    ),
    "load_dependent_friction of the drive": (
        friction("elbow", 0.2),
        lambda model, data: model.dof_frictionloss.__setitem__(1, 0.2 + 0.4 * abs(data.qfrc_actuator[1])),
        effect("load_dependent_friction", "elbow", "elbow", limit_0=0.2, mu=0.4, of_actuator=1.0),
    ),
    "gear_friction": (
        friction("elbow", 0.2),
        lambda model, data: model.dof_frictionloss.__setitem__(1, in_gear(model, data)),
        effect("gear_friction", "elbow", "elbow", limit_0=0.2, mu_drive=0.1, mu_weight=0.1, mu_rest=0.2, velocity=0.4, growth=0.005),
    ),
    "cogging": (
        None, pushed(lambda t, q, v: -1.2 * math.sin(7.0 * q + math.atan2(0.5, 1.0)) , "elbow"),
        effect("cogging", "elbow", "elbow", sine=1.2 / math.hypot(1.0, 0.5), cosine=0.6 / math.hypot(1.0, 0.5), periods_per_turn=7.0),
    ),
    "cogging by its pitch": (
        None, pushed(lambda t, q, v: -1.2 * math.sin(7.0 * q + math.atan2(0.5, 1.0)) , "elbow"),
        effect("cogging", "elbow", "elbow", sine=1.2 / math.hypot(1.0, 0.5), cosine=0.6 / math.hypot(1.0, 0.5), pitch=2.0 * math.pi / 7.0),
    ),
}  # fmt: skip


@pytest.mark.parametrize(
    ("variant", "signal"), [("analogue", analogue_lag), ("", digital_lag)], ids=["analogue", "digital"]
)
def test_a_lag_is_mujocos_filter_whichever_it_is(tmp_path, variant, signal):
    case, tau = stage_case(tmp_path, n=600), 0.02
    found = replace(effect("actuator_lag", channel="shaker", time_constant=tau), variant=variant)
    runge = RunOptions(integrator=mujoco.mjtIntegrator.mjINT_RK4)
    applied = apply(case.folder / case.rig, Findings((found,)), case=case, options=runge)
    assert [change.form for change in applied.changes] == ["native"]
    bare = apply(case.folder / case.rig, Findings(()), case=case, options=runge)
    lagged = replace(
        case,
        validation=tuple(
            replace(r, values=r.values | {"shaker": signal(r.values["shaker"], np.array([tau]), r.step)})
            for r in case.validation
        ),
    )
    ((filtered,),), ((true,),) = (
        LinearReplay.of(c, structure_of(c)).readings(a, ()).values()
        for c, a in ((case, applied), (lagged, bare))
    )
    # the delay of what is slow is right; what is left goes as the square of the frequency
    assert np.std(filtered.simulated - true.simulated) < 4e-3 * np.std(true.simulated)


def test_what_comes_nearest_goes_with_its_own_numbers():
    numbers = {
        name: NominalEstimate("stiffness:guide", value, 1.0, 800.0, 8.0, 0.0)
        for name, value in (("free", 790.0), ("near", 810.0))
    }
    gap = Gap("m", 1.0, 0.9, 0.2, 0.01, 0.8, (0.7, 0.9), dof="guide")
    unknown = Verdict(
        verdict="unknown", named=(), ranking=(), indistinguishable=(), locations=(), gap=gap, gaps=(gap,),
        probabilities={}, explanation="", nominal=(numbers["free"],), nearest=(effect("coulomb_friction", "guide", limit=3.0),),
        nearest_nominal=(numbers["near"],), nearest_left=(0.4,),
    )  # fmt: skip
    assert findings_of(unknown, nearest=True).nominal[0].value == 810.0
    assert gaps_left(unknown)[0].after == 0.4
    # of robots, and of older verdicts, `nominal` and the gaps are of what comes nearest
    same = replace(unknown, nearest_nominal=(), nearest_left=())
    assert findings_of(same, nearest=True).nominal[0].value == 790.0
    assert gaps_left(same) == (gap,)


def carried(model, data):
    """Torque that the elbow carries, by inverse dynamics of the bodies alone."""
    full = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, full)
    return (full @ data.qacc)[1] - model.dof_armature[1] * data.qacc[1] + data.qfrc_bias[1]


def in_gear(model, data):
    """Limit of the friction in the gear of the elbow."""
    full = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, full)
    weight = carried(model, data) - (full[1, 1] - model.dof_armature[1]) * data.qacc[1]
    drive = data.qfrc_actuator[1]
    at_rest = 0.2 * abs(weight) * math.exp(-((data.qvel[1] / 0.4) ** 2))
    return 0.2 + abs(0.1 * drive + 0.1 * weight) + at_rest + 0.005 * drive**2


@pytest.mark.parametrize("name", ARM_EFFECTS)
def test_an_effect_on_an_arm_closes_in_plain_mujoco(tmp_path, name):
    wrong, before_step, found = ARM_EFFECTS[name]
    case = arm_case(tmp_path, wrong or (lambda spec: None), before_step)
    worth = verified(case, [found], ("shoulder", "elbow"), goal=0.008)
    # where the integrator of the model does not do, the setting that does is named
    assert bool(worth.better) == bool(worth.remedy)
    figures = {f.dof: f for f in (*worth.figures, *worth.better)}
    assert figures["elbow"].before > 0.03
    assert figures["elbow"].after < 0.05 * figures["elbow"].before + 0.005, figures
    assert figures["shoulder"].after < 0.01


def geared(stiffness, damping, width):
    """A motor of its own, which turns a rotor that bears on the link through a spring with play."""

    def wrong(spec):
        elbow = spec.joint("elbow")
        elbow.armature, elbow.damping = 0.008, np.zeros(3)
        body = spec.body("upper").add_body(
            name="rotor", mass=1e-6, inertia=np.full(3, 1e-9), explicitinertial=True
        )
        body.add_joint(
            name="rotor",
            type=mujoco.mjtJoint.mjJNT_HINGE,
            axis=(0, 1, 0),
            armature=0.012,
            damping=(0.3, 0, 0),
        )
        spec.actuator("m2").target = "rotor"

    def before_step(model, data):
        bent, rate = data.qpos[2] - data.qpos[1], data.qvel[2] - data.qvel[1]
        beyond = dead(bent, width)
        torque = stiffness * beyond + (damping * rate if beyond or not width else 0.0)
        data.qfrc_applied[1:3] = torque, -torque

    return wrong, before_step


@pytest.mark.parametrize("name", ["joint_compliance", "backlash"])
@pytest.mark.parametrize("side", [0.0, 1.0])
def test_a_train_becomes_two_joints(tmp_path, name, side):
    width = 0.05 if name == "backlash" else 0.0
    stiffness = 120.0 if width else 25.0
    # the servo acts on the motor in either case; the encoder of the log sits on the side
    case = arm_case(tmp_path, *geared(stiffness, 0.3, width), read=lambda q: q[:, [0, 1 if side else 2]])
    values: dict[str, Any] = {"half_clearance": width} if width else {}
    values |= {"stiffness": stiffness, "damping": 0.3, "motor_share": 0.6, "encoder_on_link": side}
    found = effect(name, "elbow", "elbow", **values)
    figures = {f.dof: f for f in verified(case, [found], ("shoulder", "elbow")).figures}
    assert figures["elbow"].after < 0.15 * figures["elbow"].before + 0.01, figures


def saved(case: Case) -> Path:
    """The case as a folder: nominal.json and CSV."""
    assert case.folder is not None
    channels = {
        c.name: {"unit": c.unit, "role": c.role, "noise_std": c.noise_std, **dict([c.target.split(":")] if c.target else []),
                 **({"quantity": c.quantity} if c.quantity else {})}
        for c in case.channels
    }  # fmt: skip
    for entry in channels.values():
        if entry["noise_std"] is None:
            del entry["noise_std"]
        if entry["role"] == "response":
            del entry["role"]
    document = {
        "rig": case.rig, "channels": channels,
        "parameters": {p.name: {"value": p.value, "std": p.std, "unit": p.unit} for p in case.parameters},
    }  # fmt: skip
    (case.folder / "nominal.json").write_text(json.dumps(document))
    for record in (*case.identification, *case.validation):
        rows = np.column_stack([record.time, *record.values.values()])
        header = ",".join(["time", *record.values])
        np.savetxt(
            case.folder / f"{record.name}.csv", rows, delimiter=",", header=header, comments="", fmt="%.9g"
        )
    return case.folder


@pytest.mark.slow
def test_from_a_log_to_a_corrected_model_by_two_commands(tmp_path, capsys):
    folder = saved(stage_case(tmp_path / "case", friction("guide", 3.0), n=1500, noise=2e-4))
    verdict, corrected, ranges_file = (
        folder / "verdict.json",
        tmp_path / "corrected.xml",
        tmp_path / "ranges.yaml",
    )
    assert main(["diagnose", str(folder), "--json", str(verdict), "--most", "1", "--no-progress"]) == 0
    capsys.readouterr()
    command = ["apply", str(verdict), "--model", str(folder / "stage.xml"), "-o", str(corrected)]
    assert main([*command, "--json", str(tmp_path / "a.json"), "--ranges", str(ranges_file)]) == 0
    printed = capsys.readouterr().out
    document = json.loads((tmp_path / "a.json").read_text())
    assert [effect["name"] for effect in document["named"]] == ["coulomb_friction"]
    (figure,) = document["applied"]["figures"]
    assert document["applied"]["line"] in printed
    assert "in your simulator" in printed
    assert figure["before"] > 0.2
    assert figure["after"] < 0.05 * figure["before"]
    # in the user's own simulator the model as it came stands for the diagnosis's
    assert abs(figure["before"] - document["gap"]["before"]) < 0.05 * document["gap"]["before"]
    assert figure["short"] < 0.05 or document["applied"]["remedy"] in printed
    text = corrected.read_text()
    assert "stiffness 800 to " in text
    assert "stated sigmas" in text
    assert "frictionloss" in text
    model = mujoco.MjModel.from_xml_path(str(corrected))
    assert model.dof_frictionloss[0] == pytest.approx(3.0, rel=0.02)
    assert "coulomb_friction" in ranges_file.read_text()
    assert not (tmp_path / "corrected.py").exists()
    assert main(command) == 2  # nothing is overwritten unasked
    assert "exists and is not overwritten" in capsys.readouterr().err


def test_what_mjcf_cannot_hold_becomes_a_snippet_that_runs(tmp_path):
    (tmp_path / "arm.xml").write_text(ARM)
    found = [
        effect("presliding_friction", "elbow", "elbow", limit=0.6, stiffness=30.0, damping=0.1),
        effect("stribeck_friction", "shoulder", "shoulder", limit=0.4, rise=0.5, velocity=0.1),
    ]
    applied = apply(tmp_path / "arm.xml", Findings(tuple(found)), linear=False)
    write_model(applied, tmp_path / "new.xml", "arm.xml")
    code = snippet(applied, "new.xml")
    (tmp_path / "new.py").write_text(code)
    space: dict[str, Any] = {"__file__": str(tmp_path / "new.py"), "__name__": "snippet"}
    exec(compile(code, "new.py", "exec"), space)
    model = space["model"]
    data = mujoco.MjData(model)
    data.qvel[:] = 0.5
    space["before_step"](model, data)
    assert model.dof_frictionloss[0] == pytest.approx(0.4 * (1.0 + 0.5 * math.exp(-25.0)))
    for _ in range(50):
        data.ctrl[0] = 1.0
        space["before_step"](model, data)
        mujoco.mj_step(model, data)
    assert np.isfinite(data.qpos).all()
    assert data.act[-1] != 0.0
    assert [change.form for change in applied.changes] == ["callback", "step"]


def test_numbers_stand_in_the_file_with_what_they_were(tmp_path):
    (tmp_path / "arm.xml").write_text(ARM)
    nominal = (
        NominalEstimate("damping:shoulder", 0.36, 0.01, 0.3, 0.03, 2.0),
        NominalEstimate("kp:m1", 44.0, 0.5, 40.0, 4.0, 1.0),
        NominalEstimate("mass:fore", 0.8, 0.01, 0.7, 0.05, 2.0),
    )
    found = (
        effect("mass_error", "fore", "elbow", payload=0.5),
        effect("com_error", "upper", "shoulder", shift_x=0.01, shift_y=0.0, shift_z=-0.02),
        effect("position_offset", "elbow", "elbow", offset=0.02, in_loop=1.0),
        effect("base_tilt", "base", "", tilt_x=0.0, tilt_y=0.1),
    )
    applied = apply(tmp_path / "arm.xml", Findings(found, nominal), linear=False)
    (tmp_path / "sub").mkdir()
    write_model(applied, tmp_path / "sub" / "new.xml", "arm.xml")
    old, new = (mujoco.MjModel.from_xml_path(str(tmp_path / name)) for name in ("arm.xml", "sub/new.xml"))
    assert new.dof_damping[0] == pytest.approx(0.36)
    assert new.actuator_gainprm[0, 0] == pytest.approx(44.0)
    assert new.actuator_biasprm[0, 1] == pytest.approx(-44.0)
    assert new.body("fore").mass[0] == pytest.approx(1.3)
    centre = (0.8 * old.body("fore").ipos[0] + 0.5 * 0.25) / 1.3
    assert new.body("fore").ipos[0] == pytest.approx(centre, abs=1e-6)
    assert new.body("upper").ipos - old.body("upper").ipos == pytest.approx([0.01, 0.0, -0.02], abs=1e-6)
    assert new.actuator_biasprm[1, 0] == pytest.approx(-40.0 * 0.02)
    assert new.opt.gravity == pytest.approx([9.81 * np.sin(0.1), 0.0, -9.81 * np.cos(0.1)], rel=1e-4)
    text = model_text(applied, tmp_path, "arm.xml")
    for words in ("damping 0.3 to 0.36", "+2.00 stated sigmas", "changes the log, not the model"):
        assert words in text
    lines = text.splitlines()
    at = next(i for i, line in enumerate(lines) if '<body name="fore"' in line)
    assert "<!-- mass_error: 0.5 kg" in lines[at - 1] or "<!-- mass_error: 0.5 kg" in lines[at - 2]
    rows = {row["parameter"]: row for row in ranges(Findings(found, nominal))}
    assert rows["kp:m1"]["low"] == pytest.approx(44.0 - 1.96 * 0.5)


def test_the_simulators_own_share_is_named(tmp_path):
    """Friction of the model itself, with MuJoCo's defaults, at a coarse step: soft, and no physics is missing."""
    case = stage_case(tmp_path, friction("guide", 3.0))
    coarse = STAGE.replace('timestep="0.001"', 'timestep="0.002"').replace(
        'damping="6"', 'damping="6" frictionloss="3"'
    )
    (tmp_path / "stage.xml").write_text(coarse)
    found = verified(case, [], goal=0.02)
    (figure,) = found.figures
    assert found.own_share == pytest.approx(figure.before, rel=0.2)
    assert found.own_share > 0.03
    assert "your simulator's own share" in found.simulator_line
    assert found.remedy  # a model without what is missing is off by all of it: said, not hidden


def test_a_body_is_divided_and_moves_as_heavily_as_before(tmp_path):
    """About a hinge, too, whose axis does not pass through the centre of mass; and not where the body has too little itself."""
    (tmp_path / "arm.xml").write_text(ARM)
    found = effect("carried_mass", "elbow", theta=(0.004, 7.0, 0.02), share=0.2)
    applied = apply(tmp_path / "arm.xml", Findings((found,)), linear=False)
    nominal, divided = mujoco.MjModel.from_xml_string(ARM), applied.compiled()
    spring = divided.joint("added_elbow_spring")
    np.testing.assert_allclose(spring.stiffness[0], 0.004 * (2.0 * math.pi * 7.0) ** 2)
    inertia = []
    for model in (nominal, divided):
        data, whole = mujoco.MjData(model), np.zeros((model.nv, model.nv))
        mujoco.mj_forward(model, data)
        mujoco.mj_fullM(model, data, whole)
        inertia.append(whole)
    np.testing.assert_allclose(inertia[1][:2, :2], inertia[0], rtol=1e-9)  # both parts together, as one
    assert inertia[1][2, 2] == pytest.approx(0.004, rel=1e-6)  # the part that is carried, about the hinge
    heavy = apply(tmp_path / "arm.xml", Findings((replace(found, theta=(1.0, 7.0, 0.02)),)), linear=False)
    assert [change.form for change in heavy.changes] == ["none"]


def test_a_verdict_that_names_nothing_is_not_applied(tmp_path, capsys):
    folder = saved(stage_case(tmp_path / "case", n=400))
    gap = {
        "metric": "x",
        "before": 1,
        "parameters_only": 1,
        "after": 1,
        "noise_floor": 1,
        "closed": 0,
        "closed_ci95": [0, 0],
    }
    verdict = {
        "verdict": "unknown", "named": [], "ranking": [], "indistinguishable": [], "locations": [], "gap": gap, "gaps": [gap],
        "probabilities": {"unknown": 1.0}, "explanation": "",
    }  # fmt: skip
    (folder / "verdict.json").write_text(json.dumps(verdict))
    assert (
        main(
            [
                "apply",
                str(folder / "verdict.json"),
                "--model",
                str(folder / "stage.xml"),
                "-o",
                str(tmp_path / "x.xml"),
            ]
        )
        == 2
    )
    assert "'unknown'" in capsys.readouterr().err
    assert not (tmp_path / "x.xml").exists()
