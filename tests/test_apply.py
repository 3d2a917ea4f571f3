"""A verdict in the user's own model: effects put into a copy of a small model, run in MuJoCo, applied, closed.

The truth is made in MuJoCo with finer steps, and where MuJoCo has the effect by another road than the one that applies it; the verdict
is written by hand with the true numbers, so that what is left is what applying costs. Nothing here has noise.
"""

from __future__ import annotations

import json
import math
from pathlib import Path

import mujoco
import numpy as np
import pytest

from bench.cli import main
from bench.discrepancy import Case, CaseChannel, diagnose, record_from_arrays
from bench.discrepancy.application.applying import Findings, apply
from bench.discrepancy.application.verification import verify
from bench.discrepancy.application.writing import model_text, ranges, snippet, write_model
from bench.discrepancy.case.case import NominalParameter
from bench.discrepancy.verdict import Estimate, Gap, NamedEffect, NominalEstimate

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
RATE, FINER = 500.0, 8
"""Sample rate [Hz], and steps of the truth in a step of the model."""


def effect(name, where="", channel="", law="", theta=(), **values):
    estimates = {key: Estimate(float(value), 0.01 * abs(value), "") for key, value in values.items()}
    return NamedEffect(name, where, 0.99, estimates, channel=channel, equation=name, law=law, theta=tuple(theta))


def smooth(rng, n, low, high, level):
    spectrum = np.fft.rfft(rng.standard_normal(n))
    frequency = np.fft.rfftfreq(n, 1.0 / RATE)
    spectrum[(frequency < low) | (frequency > high)] = 0.0
    samples = np.fft.irfft(spectrum, n)
    return level * samples / np.std(samples) * np.minimum(np.arange(n) / 200.0, 1.0)


def measured(xml, wrong, commands, before_step=None):
    """Positions (n, nq) of a model made wrong by `wrong(spec)`, at finer steps, controls along straight lines between samples."""
    spec = mujoco.MjSpec.from_string(xml)
    own = float(spec.option.timestep)
    spec.option.timestep = own / FINER
    wrong(spec)
    model = spec.compile()
    data = mujoco.MjData(model)
    n = len(commands)
    per = round(1.0 / RATE / model.opt.timestep)
    fine = np.column_stack([
        np.interp((np.arange(n * per) + 0.5) / per, np.arange(n), column) for column in commands.T
    ])  # fmt: skip
    out = np.empty((n, model.nq))
    for k, row in enumerate(fine):
        if k % per == 0:
            out[k // per] = data.qpos
        data.ctrl[:] = row
        if before_step is not None:
            before_step(model, data)
        mujoco.mj_step(model, data)
    return out


def stage_case(folder: Path, wrong=lambda spec: None, before_step=None, n=1500, level=12.0) -> Case:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "stage.xml").write_text(STAGE)
    records = []
    for seed, name in enumerate(("identification", "validation")):
        force = smooth(np.random.default_rng(seed), n, 0.5, 8.0, level)
        x = measured(STAGE, wrong, force[:, None], before_step)[:, 0]
        records.append(record_from_arrays(name, np.arange(n) / RATE, {"shaker": force, "displacement": x}))
    return Case(
        "stage", "stage.xml",
        (NominalParameter("mass:table", 2.0, 0.02), NominalParameter("stiffness:guide", 800.0, 8.0),
         NominalParameter("damping:guide", 6.0, 0.6)),
        (CaseChannel("shaker", "N", "command", None, None, "actuator:shaker"), CaseChannel("displacement", "m", "response", 1e-5)),
        (records[0],), (records[1],), folder,
    )  # fmt: skip


def arm_case(folder: Path, wrong=lambda spec: None, before_step=None, n=1500, read=None) -> Case:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "arm.xml").write_text(ARM)
    records = []
    for seed, name in enumerate(("identification", "validation")):
        rng = np.random.default_rng(10 + seed)
        target = np.column_stack([smooth(rng, n, 0.2, 2.0, 0.4), smooth(rng, n, 0.2, 2.5, 0.5)])
        q = measured(ARM, wrong, target, before_step)
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
