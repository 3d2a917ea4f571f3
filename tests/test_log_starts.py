"""Logs that begin while the robot moves: where a joint starts, and what is not known of that."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest
from test_articulated import NOISE, RATE, mjcf, write_case

from bench.discrepancy import diagnose, read_case
from bench.discrepancy.articulated.admission import admitted_robot
from bench.discrepancy.articulated.recognition import applies
from bench.discrepancy.articulated_search.fitting import ArticulatedFit
from bench.discrepancy.articulated_search.innovations import UnknownStart
from bench.discrepancy.articulated_search.problem import ArticulatedProblem
from bench.discrepancy.motion.kalman_smoother import smooth_motion
from bench.discrepancy.multibody.model import ArticulatedModel


def cut(folder, seconds):
    """The records of a case without their beginning."""
    for path in (folder / f"{name}.csv" for name in ("identification", "validation")):
        head, *rows = path.read_text().splitlines()
        path.write_text("\n".join([head, *rows[round(seconds * RATE) :]]) + "\n")
    return folder


def test_smoothed_motion_starts_where_it_is():
    rng, step = np.random.default_rng(0), 1.0 / RATE
    clock = step * np.arange(600)
    errors = []
    for phase in np.linspace(0.0, 6.0, 12):
        angles = 2.0 * np.pi * np.array([0.25, 0.6, 1.1])[:, None] * clock + phase * np.array(
            [[1.0], [2.0], [3.0]]
        )
        position = 0.35 * np.sin(angles).sum(axis=0)
        measured = position + NOISE * rng.standard_normal(len(clock))
        smooth = smooth_motion(measured[:, None], (0,), np.array([NOISE]), step)
        errors.append(smooth[0, 0] - position[0])
    # one reading tells the position to its noise; a straight line through the first twelve is off by twenty times that
    assert np.sqrt(np.mean(np.square(errors))) < 1.3 * NOISE


@pytest.mark.parametrize("servo", [True, False], ids=["servo", "torque"])
@pytest.mark.parametrize("seconds", [0.7, 2.2])
def test_a_log_that_was_cut_leaves_no_more_than_noise(tmp_path, servo, seconds):
    folder = cut(write_case(tmp_path, mjcf(servo=servo), servo=servo), seconds)
    case, compiled, _ = admitted_robot(read_case(folder))
    problem = ArticulatedProblem.of(case, ArticulatedModel.of(compiled), case.identification)
    found = ArticulatedFit.at(problem, (), np.zeros(len(problem.nominal)))
    # 380 samples of a chain whose other joint moves as it was smoothed: up to 176 where the start was believed
    assert (found.reduced < 1.4).all()
    start = problem.start(0, problem.records[0])
    assert (start.kept < 0.3).any()  # the velocity is known ten times worse than a run would have it
    # to know less of the start costs likelihood
    assert start.log_determinant > 0.0
    power = found.chi2
    assert problem.log_likelihood(power) < problem.log_likelihood(0.5 * power)


def test_what_a_start_does_to_innovations_is_counted_by_what_is_known_of_it(tmp_path):
    folder = write_case(tmp_path, mjcf(servo=True), servo=True)
    case, compiled, _ = admitted_robot(read_case(folder))
    problem = ArticulatedProblem.of(case, ArticulatedModel.of(compiled), case.identification)
    record = problem.records[0].joints[0]
    decay = np.exp(-np.arange(50) / 10.0)

    def innovations(start):
        return (np.outer(decay, [1.0, 0.0]) @ start + np.outer(decay**2, [0.0, 1.0]) @ start)[:, None] / NOISE

    unknown = UnknownStart.of(record, innovations)
    changes = np.column_stack([(innovations(one) - innovations(np.zeros(2))).ravel() for one in np.eye(2)])
    whole = np.eye(50) + changes @ record.start_covariance @ changes.T
    rng = np.random.default_rng(0)
    for left in rng.standard_normal((5, 50, 1)):
        taken = unknown.taken_out(left)
        assert float(np.sum(taken**2)) == pytest.approx((left.T @ np.linalg.solve(whole, left)).item())
    assert unknown.log_determinant == pytest.approx(0.5 * np.linalg.slogdet(whole)[1])


BLOCK = """<mujoco><option timestep="0.0001" gravity="0 0 0" integrator="RK4" density="{density}"/><worldbody><body name="block">
<joint name="guide" type="slide" axis="1 0 0" stiffness="{stiffness}" damping="3"/><geom type="box" size="0.1 0.1 0.1" mass="2"/></body>
</worldbody><actuator><{drive} name="push" joint="guide" {filter}/></actuator></mujoco>"""
PLAIN = {"density": "0", "stiffness": "300", "drive": "motor", "filter": ""}
BENT = {
    "spring": {"stiffness": "300 0 1e5"},
    "medium": {"density": "20"},
    "filter": {"drive": "general", "filter": 'dyntype="filterexact" dynprm="0.01"'},
}


@pytest.mark.parametrize("name", [None, *BENT])
def test_a_joint_that_no_linear_structure_describes_is_a_robot_of_one_joint(tmp_path, name):
    text = BLOCK.format(**(PLAIN | BENT.get(name, {})))
    (tmp_path / "model.xml").write_text(text)
    model = mujoco.MjModel.from_xml_string(text)
    for seed, record in enumerate(("identification", "validation")):
        rng, data = np.random.default_rng(seed), mujoco.MjData(model)
        push = 5.0 * np.convolve(rng.standard_normal(800), np.ones(10) / 10.0, "same")
        rows = []
        for k, force in enumerate(push):
            rows.append([k * 0.005, force, data.qpos[0]])
            data.ctrl[0] = force
            mujoco.mj_step(model, data, 50)
        table = np.array(rows)
        table[:, 2] += 1e-5 * rng.standard_normal(len(table))
        np.savetxt(tmp_path / f"{record}.csv", table, delimiter=",", header="time,force,x", comments="")
    (tmp_path / "nominal.json").write_text(
        """{"rig": "model.xml", "load_interpolation": "zero_order_hold", "parameters": {
        "mass:block": {"value": 2, "std": 0.04, "unit": "kg"}, "damping:guide": {"value": 3, "std": 0.6, "unit": "N s/m"}}, "channels": {
        "force": {"unit": "N", "role": "measured", "actuator": "push", "noise_std": 0}, "time": {"unit": "s"},
        "x": {"unit": "m", "joint": "guide", "quantity": "position"}}}"""
    )
    case = read_case(tmp_path)
    assert applies(case) is (name is not None)
    if name == "spring":
        verdict = diagnose(case).verdict
        assert (verdict.verdict, verdict.complete) == ("none", False)
        assert "whose size nobody stated" in verdict.explanation
