"""Cases of the fifth laboratory: integrated rightly, graded by names that exist, reproducible, and read as meant."""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.signal import lsim

from bench.discrepancy import read_case
from bench.discrepancy.effects.catalogue import CATALOGUE

SCRIPTS = Path(__file__).resolve().parents[1] / "scripts"
sys.path.insert(0, str(SCRIPTS))

from fifth_laboratory_cases import actuators, hydraulics, mounts, turning  # noqa: E402
from fifth_laboratory_cases.beam import BEAM  # noqa: E402
from fifth_laboratory_cases.case import Record, Run  # noqa: E402
from fifth_laboratory_cases.catalogue import CASES  # noqa: E402
from fifth_laboratory_cases.grading import acceptance  # noqa: E402
from fifth_laboratory_cases.logger import coloured, logged  # noqa: E402
from fifth_laboratory_cases.motion import Oscillator, Signal  # noqa: E402
from fifth_laboratory_cases.signals import band, moves, multisine, steps  # noqa: E402
from fifth_laboratory_cases.sizing import Size, sizes_of  # noqa: E402
from fifth_laboratory_cases.stepping import at_half_steps  # noqa: E402
from fifth_laboratory_cases.writing import overview, write_case  # noqa: E402
from fourth_laboratory_cases.sizing import nrmse  # noqa: E402
from measured.acceptance import acceptances  # noqa: E402

TIGHT = {"method": "DOP853", "rtol": 1e-9, "atol": 1e-12}
NO_EFFECT = {"force_drift", "inertia_error"}
"""Names of the author that no effect has."""


def short(case, seconds=2.0):
    """A case with shorter records."""
    return replace(case, seconds=seconds)


def load_of(case, number=0, seconds=2.0):
    """The excitation of a record at each half step, with its times [s]."""
    run = Run(case.records[number], (), seconds, case.rate, case.substeps, {}, True, True)
    return run.half_steps(), run.load()


def sines(t, seconds=None):
    """A load that any integrator may sample where it likes."""
    return np.sin(2 * np.pi * 1.3 * t) + 0.7 * np.sin(2 * np.pi * 6.1 * t + 0.4) * np.sin(t)


def driven(case, size):
    """A case with one short record, driven by sines of a size."""
    return short(replace(case, records=(Record("validation", lambda t, seconds: size * sines(t)),)))


def solved(derivative, n_states, size, n, h):
    """States (n_states, n) at each step [s] from rest, under sines of a size."""

    def rate(now, state):
        return derivative(now, state, size * sines(now))

    t = np.arange(n) * h
    return solve_ivp(rate, (0.0, t[-1]), np.zeros(n_states), t_eval=t, **TIGHT).y


@pytest.mark.slow
def test_spool_lags_behind_a_held_command():
    case = short(replace(actuators.SPOOL, records=(Record("validation", steps(510)),)), 0.5)
    found = case.simulated(0, effect=True, background=False)
    commanded, p = found["commanded"].values, case.truth()
    assert len(commanded) == 1000
    # one pole before the oscillator; a held command is integrated exactly from sample to sample
    lag = np.array([[0.0, 1.0, 0.0], [-p["stiffness"], -p["damping"], 1.0], [0.0, 0.0, -1.0 / 2.2e-3]])
    lag[1] /= p["mass"]
    input_gain = np.array([[0.0], [0.0], [1.0 / 2.2e-3]])
    t = np.arange(1000) / 2000.0
    _, _, x = lsim((lag, input_gain, np.eye(3), np.zeros((3, 1))), commanded, t, interp=False)
    np.testing.assert_allclose(found["displacement"].values[:-10:10], x[:, 0], rtol=0.0, atol=1e-8)
    prompt = case.simulated(0, effect=False, background=False)["displacement"]
    assert nrmse(prompt.values, found["displacement"].values) > 0.1


def test_strut_is_softer_in_compression_and_meets_its_stop():
    p = hydraulics.Strut(2e4, 1500.0, 0.4, 7e4, 10.0, 0.0, 0.0, 0.0)
    x, v = np.array([0.0, 0.0, 0.034, 0.024]), np.array([1.0, -1.0, 0.0, 0.0])
    found = hydraulics.strut_force(p, x, v, np.zeros(4), np.zeros(4))
    np.testing.assert_allclose(found, [900.0, -2100.0, 680.0 + 700.0 * 1.1, 480.0])
    besides = p._replace(friction=14.0, grip=0.5, hum=3.0)
    still, one = np.zeros(1), np.ones(1)
    found = hydraulics.strut_force(besides, still, still, one, 0.005 * one)
    np.testing.assert_allclose(found, 0.5 + 3.0)


def test_cylinder_is_braked_outwards_only():
    p = hydraulics.Cylinder(Oscillator(60.0, 0.0, 0.0), 900.0, 0.0, 0.0)

    def braked(x, v):
        loads = at_half_steps(np.zeros(3))
        return -60.0 * hydraulics.cylinder_march(p, np.array([x, v, x, v]), loads, 1e-4).rate[0, 1]

    found = [braked(0.018, 0.1), braked(-0.028, -0.1), braked(0.018, -0.1), braked(0.008, 0.1)]
    np.testing.assert_allclose(found, [90.0 / 1.25, -360.0 / 2.0, 0.0, 0.0], atol=1e-9)


@pytest.mark.slow
def test_air_seat_relaxes_and_its_gas_is_the_linear_law_when_it_moves_little():
    case = driven(mounts.AIRSEAT, 0.6)
    t, floor = load_of(case)
    p = case.truth()
    m, k, c = p["mass:seat"], p["stiffness:suspension"], p["damping:suspension"]

    def derivative(now, s, acceleration):
        y, w, force = s
        # of a Maxwell element: its force relaxes with 0.15 s
        return w, -(k * y + c * w + force) / m - acceleration, 2200.0 * w - force / 0.15

    y, w, _ = solved(derivative, 3, 0.6, len(t[::2]), t[2])
    found = case.simulated(0, effect=True, background=False)["displacement"]
    np.testing.assert_allclose(found.values, y, rtol=0.0, atol=1e-6 * np.std(y))
    np.testing.assert_allclose(found.rate, w, rtol=0.0, atol=1e-6 * np.std(w))
    gas = mounts.AirSeat(Oscillator(m, k, c), 2200.0, 0.15, True, 0.0, 0.0)
    start = np.array([0.0, 0.0, mounts.REST, mounts.REST, 0.0, 0.0])
    little = mounts.seat_march(gas, start, at_half_steps(1e-3 * floor), t[2]).state[:, 0]
    assert nrmse(1e3 * little, y) < 1e-3
    much = mounts.seat_march(gas, start, at_half_steps(floor), t[2]).state[:, 0]
    assert nrmse(much, y) > 5e-3, "the gas is curved"


def test_friction_of_the_screw_axis_falls_with_the_speed():
    p = actuators.Axis(38.0, 0.0, 21.0, 39.0, 0.0, 0.0, 0.0)
    asked = at_half_steps(np.zeros((3, 3)))

    def friction(v):
        march = actuators.axis_march(p, np.array([0.0, v, 0.0, v]), asked, 1e-5)
        return -38.0 * march.rate[0, 1] - actuators.DAMPED * v

    assert [friction(v) for v in (0.002, 0.022, 0.2, -0.2)] == pytest.approx(
        [21.0 + 18.0 * np.exp(-(0.002**2) / 0.022**2), 21.0 + 18.0 / np.e, 21.0, -21.0], rel=1e-6
    )


def test_screw_axis_follows_and_its_force_moves_it():
    case = short(replace(actuators.SCREW_AXIS, records=(Record("validation", moves(507)),)))
    found, p = case.simulated(0, effect=True, background=False), case.truth()
    assert np.max(np.abs(found["load"].values - found["displacement"].values)) < 1e-3
    v, a, force = (found[name].values for name in ("velocity", "acceleration", "force"))
    law = (21.0 + 18.0 * np.exp(-((v / 0.022) ** 2))) * np.tanh(v / 2e-4)
    left = force - p["mass"] * a - p["damping"] * v - law
    assert np.max(np.abs(left)) < 1e-6 * np.max(np.abs(force))
    # the work of the force is what friction and damping take and the motion holds
    given = np.trapezoid(force * v, dx=1.0 / 500 / 40)
    taken = np.trapezoid(law * v + p["damping"] * v * v, dx=1.0 / 500 / 40) + 0.5 * p["mass"] * v[-1] ** 2
    assert given == pytest.approx(taken, rel=1e-4)


@pytest.mark.parametrize(
    ("case", "joint", "number"), [(turning.DRIVE_LINE, 1, 0), (turning.COMPOUND_PENDULUM, 0, 1)]
)
def test_model_of_the_bench_moves_as_the_rig_does(case, joint, number):
    model = mujoco.MjModel.from_xml_string(case.model)
    data = mujoco.MjData(model)
    exact = {name: p._replace(std=0.0) for name, p in case.parameters.items()}
    found = short(replace(case, parameters=exact)).simulated(number, effect=False, background=False)
    t, load = load_of(case, number)
    data.qpos[0], data.qvel[0] = np.radians(case.records[number].start)
    h, angles = model.opt.timestep, []
    for i in range(round(2.0 / h)):
        angles.append(data.qpos[joint])
        data.qfrc_applied[0] = np.interp((i + 0.5) * h, t, load)
        mujoco.mj_step(model, data)
    seen = found["twist" if joint else "displacement"].sampled(np.arange(len(angles)) * h, t[2])
    # MuJoCo holds the load of the middle of a step: an error of (omega h)^2 / 24
    assert nrmse(np.array(angles), seen) < 2e-4


def test_hub_of_the_drive_line_is_an_inertia():
    case = short(turning.DRIVE_LINE)
    heavier = dict(case.parameters)
    heavier["inertia:brake_disc"] = heavier["inertia:brake_disc"]._replace(value=0.034)
    told = replace(case, parameters=heavier).simulated(0, effect=False, background=False)
    found = case.simulated(0, effect=True, background=False)
    np.testing.assert_allclose(found["twist"].values, told["twist"].values, rtol=0.0, atol=1e-12)


def test_mount_softens_as_it_warms():
    case = driven(mounts.MOUNT_WARM, 30.0)
    p, t = case.truth(), load_of(case)[0]

    def derivative(now, s, force):
        stiffness = p["stiffness"] * (1.0 - 0.12 * (1.0 - np.exp(-now / 20.0)))
        return s[1], (force - p["damping"] * s[1] - stiffness * s[0]) / p["mass"]

    x, v = solved(derivative, 2, 30.0, len(t[::2]), t[2])
    found = case.simulated(0, effect=True, background=False)["displacement"]
    np.testing.assert_allclose(found.values, x, rtol=0.0, atol=1e-6 * np.std(x))
    np.testing.assert_allclose(found.rate, v, rtol=0.0, atol=1e-6 * np.std(v))
    cold = case.simulated(0, effect=False, background=False)["displacement"].values
    assert nrmse(cold, x) > 1e-3


def test_stiffness_of_the_rotor_swings_at_twice_its_speed():
    p = turning.Rotor(Oscillator(4.0, 1.5e5, 50.0), 0.28, 2 * np.pi * 11.0, 0.3, 0.6, 0.0)
    t = np.arange(2 * 5000 + 1) * 5e-5

    def derivative(now, s, force):
        stiffness = 1.5e5 * (1.0 + 0.28 * np.cos(4 * np.pi * 11.0 * now + 0.3))
        unbalance = 0.6 * np.cos(2 * np.pi * 11.0 * now + 0.15 + 0.9)
        return s[1], (force + unbalance - 50.0 * s[1] - stiffness * s[0]) / 4.0

    x, _ = solved(derivative, 2, 10.0, 5001, 1e-4)
    found = turning.rotor_march(p, np.zeros(2), at_half_steps(10.0 * sines(t)), 1e-4).state[:, 0]
    np.testing.assert_allclose(found, x, rtol=0.0, atol=1e-6 * np.std(x))


@pytest.mark.slow
def test_beam_moves_as_its_state_space_and_its_vibrometer_is_late():
    case = short(BEAM, 1.0)
    t, load = load_of(case, seconds=1.0)
    p = case.truth()
    system = np.array([[0.0, 1.0], [-p["stiffness"] / p["mass"], -p["damping"] / p["mass"]]])
    gain = np.array([[0.0], [1.0 / p["mass"]]])
    _, v, _ = lsim((system, gain, np.array([[0.0, 1.0]]), np.zeros((1, 1))), load, t)
    found = case.simulated(0, effect=True, background=False)
    np.testing.assert_allclose(found["velocity"].values, v[::2], rtol=0.0, atol=1e-5 * np.std(v))
    table = logged(case, 0, found, noise=False, background=False)
    late = np.interp(table.t - 1.3e-3, t, v, left=0.0)
    np.testing.assert_allclose(table.columns["velocity"], 1e3 * late, rtol=0.0, atol=1e-2 * np.std(1e3 * v))


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES, ids=[case.name for case in CASES])
def test_every_case_holds_a_background_and_is_read(case, tmp_path):
    case = short(case)
    write_case(case, tmp_path)
    read = read_case(tmp_path)
    assert len(read.identification) + len(read.validation) == len(case.records)
    assert {channel.name for channel in read.channels} >= set(case.channels)
    for size in sizes_of(case).values():
        assert size.background > 0.0
        assert size.noise > 0.0
        assert size.effect >= 0.0


def test_a_signal_is_sampled_by_cubics_late_and_linearly():
    t = np.arange(11) * 0.1
    between = np.array([0.05, 0.33, 0.77])
    cubic = Signal(t**3, 3.0 * t**2)
    np.testing.assert_allclose(cubic.sampled(between, 0.1), between**3, atol=1e-12)
    np.testing.assert_allclose(
        cubic._replace(late=0.05).sampled(between, 0.1), (between - 0.05) ** 3, atol=1e-12
    )
    np.testing.assert_allclose(Signal(2.0 * t).sampled(between, 0.1), 2.0 * between)
    np.testing.assert_array_equal(Signal(t, of_samples=True).sampled(between, 0.1), t)


@pytest.mark.parametrize("made", [band, multisine])
def test_a_signal_has_the_same_size_and_band_on_any_clock(made):
    t = np.arange(4001) / 1000.0
    fine = made(3, 2.0, 9.0, 5.0, rise=0.0)(t, 4.0)
    np.testing.assert_allclose(made(3, 2.0, 9.0, 5.0, rise=0.0)(t[::4], 4.0), fine[::4], atol=1e-10)
    assert np.std(fine[:-1]) == pytest.approx(5.0, rel=1e-9)
    power = np.abs(np.fft.rfft(fine[:-1])) ** 2
    assert power[8:37].sum() == pytest.approx(power.sum(), rel=1e-9)


def test_coloured_noise_has_the_stated_size_and_colour():
    noise = coloured(np.random.default_rng(1), 200_000, 2.0, 0.9)
    assert np.std(noise) == pytest.approx(2.0, rel=0.02)
    assert np.mean(noise[1:] * noise[:-1]) / np.var(noise) == pytest.approx(0.9, rel=0.01)


def test_a_record_is_the_signal_with_noise_hum_and_gain():
    case = short(mounts.MOUNT_WARM, 8.0)
    still = {name: Signal(np.full(20_001, 2.0)) for name in ("load", "displacement", "acceleration")}
    plain = logged(case, 0, still, noise=False, background=False).columns
    assert [plain[name][5] for name in case.channels] == [2.0, 2000.0, 2.0]
    noisy = logged(case, 0, still, noise=True, background=True).columns
    assert np.mean(noisy["acceleration"]) == pytest.approx(2.0 * 1.008, rel=2e-3)
    assert [np.std(noisy[name]) for name in case.channels] == pytest.approx([0.3, 0.01, 0.04], rel=0.1)
    hum = logged(
        short(turning.DRIVE_LINE),
        0,
        dict.fromkeys(("load", "speed", "twist"), still["load"]),
        noise=False,
        background=True,
    )
    assert np.std(hum.columns["torque"]) == pytest.approx(0.012 / np.sqrt(2.0), rel=1e-2)


def test_true_values_are_off_by_their_uncertainty():
    for case in CASES:
        truth = case.truth()
        for name, p in case.parameters.items():
            off = abs(truth[name] / p.factor - p.value)
            assert off <= 1.5 * p.std * (1.0 + 1e-9)
            assert (off > 0.0) == (p.std > 0.0)


def test_acceptance_holds_every_case(tmp_path):
    (tmp_path / "acceptance.json").write_text(json.dumps(acceptance(CASES)))
    told = acceptances(tmp_path / "acceptance.json")
    assert len(told) == len(CASES) == 10
    known = {effect.name for effect in CATALOGUE}
    table = overview(CASES, [{"x": Size(0.2, 0.02, 0.01)}] * 10)
    for case in CASES:
        entry = told[case.name]
        assert case.name.startswith("fifth_")
        assert known >= entry.also.union(*entry.right) - NO_EFFECT, case.name
        assert any(known >= group for group in entry.right) or not entry.right, case.name
        assert entry.nrmse == case.limit
        assert case.why == entry.why
        assert f"| {case.name} |" in table
        assert f"- {case.name}: {case.doubtful}" in table
        assert {record.stem.partition("_")[0] for record in case.records} == {"identification", "validation"}
        assert case.records[-1].stem == "validation"


def test_a_run_is_reproducible(tmp_path):
    case = short(turning.COMPOUND_PENDULUM)
    for folder, made in (("one", case), ("again", case), ("other", replace(case, seed=1))):
        write_case(made, tmp_path / folder)
    files = sorted(path.name for path in (tmp_path / "one").iterdir())
    one, again, other = (
        [(tmp_path / folder / name).read_bytes() for name in files] for folder in ("one", "again", "other")
    )
    assert one == again
    assert one != other
