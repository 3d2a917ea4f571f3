"""Cases of the sixth laboratory: integrated rightly, graded by names that exist, reproducible, and read as meant."""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from bench.discrepancy import read_case
from bench.discrepancy.effects.catalogue import CATALOGUE

SCRIPTS = Path(__file__).resolve().parents[1] / "scripts"
sys.path.insert(0, str(SCRIPTS))

from fourth_laboratory_cases.sizing import nrmse  # noqa: E402
from measured.acceptance import acceptances  # noqa: E402
from sixth_laboratory_cases import chains, dampers, oscillators, stand, turning  # noqa: E402
from sixth_laboratory_cases.case import Channel, Run  # noqa: E402
from sixth_laboratory_cases.catalogue import CASES  # noqa: E402
from sixth_laboratory_cases.logger import disturbed, jittered, logged, read  # noqa: E402
from sixth_laboratory_cases.signals import Clock, band_noise, levels, multisine, quake, rate_of  # noqa: E402
from sixth_laboratory_cases.stage import STAGE  # noqa: E402
from sixth_laboratory_cases.stepping import straight  # noqa: E402
from sixth_laboratory_cases.writing import overview, write_acceptance, write_case  # noqa: E402

TIGHT = {"method": "DOP853", "rtol": 1e-9, "atol": 1e-12}


def short(case, seconds=2.0):
    """A case with shorter records."""
    return replace(case, seconds=seconds)


def sines(t):
    """A load that any integrator may sample where it likes."""
    return np.sin(2 * np.pi * 1.3 * t) + 0.7 * np.sin(2 * np.pi * 6.1 * t + 0.4) * np.sin(t)


def times(case, seconds=2.0):
    """Steps [s] of the integration of a case."""
    return np.arange(round(seconds / case.step()) + 1) * case.step()


def run(case, loads, **values):
    """Signals of a rig, with its effect and nothing besides, under loads at each step."""
    truth = {**case.truth(background=False), **values}
    return case.simulate(Run(truth, loads.reshape(len(loads), -1), case.step(), 0.0))


def solved(derivative, n_states, t):
    """States (n_states, n) at each step from rest."""
    return solve_ivp(derivative, (0.0, t[-1]), np.zeros(n_states), t_eval=t, **TIGHT).y


@pytest.mark.slow
def test_table_meets_its_snubber_on_one_side():
    case = oscillators.ISOLATOR
    t, p = times(case), case.truth(background=False)

    def derivative(now, s):
        x, v = s
        force = 30.0 * sines(now) - p["damping"] * v - p["stiffness"] * x
        return v, (force - 26000.0 * max(x - 3.6e-3, 0.0)) / p["mass"]

    x, _ = solved(derivative, 2, t)
    found = run(case, 30.0 * sines(t))["displacement"]
    np.testing.assert_allclose(found, x, rtol=0.0, atol=1e-5 * np.std(x))
    assert np.max(x) > 3.6e-3
    assert nrmse(run(case, 30.0 * sines(t), stop=0.0)["displacement"], x) > 0.05


def test_contact_of_the_snubber_never_pulls():
    p = oscillators.Oscillator(2.0, 0.0, 0.0, stop=1000.0, stop_at=1e-3, stop_damping=50.0)
    states = [(2e-3, 0.1), (2e-3, -0.1), (0.9e-3, 0.1), (-5e-3, -0.1)]
    still = straight(np.zeros((2, 1)))
    found = [oscillators.oscillator_march(p, np.array(s), still, 1e-6).rate[0, 1] for s in states]
    np.testing.assert_allclose(found, [-(1.0 + 5.0) / 2.0, 0.0, 0.0, 0.0])


def test_coupling_of_the_accelerometer_is_of_first_order():
    t = np.arange(40_001) / 4000.0
    late = t > 5.0
    for frequency in (0.4, 1.3, 6.0):
        ratio = frequency / 1.3
        gain, lead = ratio / np.hypot(1.0, ratio), np.arctan(1.0 / ratio)
        found = oscillators.high_pass(np.sin(2 * np.pi * frequency * t), 1 / 4000.0, 1.3)
        expected = gain * np.sin(2 * np.pi * frequency * t + lead)
        np.testing.assert_allclose(found[late], expected[late], rtol=0.0, atol=1e-4)
    np.testing.assert_array_equal(oscillators.high_pass(t, 1 / 4000.0, 0.0), t)


def test_friction_of_the_frame_and_of_the_floor_is_in_the_lower_spring():
    p = chains.Chain(2.0, 1.0, 0.0, 0.0, 0.0, 0.0, friction=3.0, creep=1e-4)
    still = straight(np.zeros((2, 2)))
    found = chains.chain_march(p, np.array([0.0, 0.0, 0.1, 0.2]), still, 1e-7).rate[0]
    np.testing.assert_allclose(found, [0.1, 0.2, -1.5, 1.5])


@pytest.mark.slow
def test_element_of_the_stand_relaxes_along_its_axis_only():
    case = stand.TESTSTAND
    t, p = times(case, 1.0), case.truth(background=False)

    def derivative(now, s):
        rates = np.zeros(9)
        rates[[0, 1, 5, 6]] = s[[2, 3, 7, 8]]
        for way, at, load in (("axial", 0, 50.0), ("torsional", 5, 1.5)):
            x, v = s[at : at + 2], s[at + 2 : at + 4]
            pull = p[f"stiffness_{way}"] * (x[1] - x[0]) + p[f"damping_{way}"] * (v[1] - v[0])
            if way == "axial":
                # a Maxwell element by its force, which relaxes with 0.05 s
                pull += s[4]
                rates[4] = 9000.0 * (v[1] - v[0]) - s[4] / 0.05
            for i, force in enumerate((load * sines(now) + pull, -pull)):
                held = p[f"mount_stiffness_{i + 1}_{way}"] * x[i] + p[f"mount_damping_{i + 1}_{way}"] * v[i]
                rates[at + 2 + i] = (force - held) / p[f"mass_{i + 1}_{way}"]
        return rates

    s = solved(derivative, 9, t)
    found = run(case, np.column_stack([50.0 * sines(t), 1.5 * sines(t)]))
    for name, i in (("displacement_1", 0), ("displacement_2", 1), ("rotation_1", 5), ("rotation_2", 6)):
        np.testing.assert_allclose(found[name], s[i], rtol=0.0, atol=1e-4 * np.std(s[i]), err_msg=name)


def test_stage_follows_and_its_force_moves_it():
    case = short(STAGE, 2.0)
    found, p, load = case.simulated(0, background=False), case.truth(background=False), case.loads[0][:, 0]
    np.testing.assert_array_equal(load[:-1].reshape(-1, 10), np.repeat(load[:-1:10, None], 10, axis=1))
    x, v = found["position"], found["velocity"]
    cogging = np.sin(2 * np.pi * x / 0.03 + 0.9)
    # the work of the force is what cogging and damping take and the motion holds
    taken = np.trapezoid((cogging + p["damping"] * v) * v, dx=case.step()) + 0.5 * p["mass"] * v[-1] ** 2
    assert np.trapezoid(found["force"] * v, dx=case.step()) == pytest.approx(taken, rel=1e-3)


def test_controller_heard_the_rig_that_it_drives():
    case = short(STAGE, 1.0)
    whole = case.simulated(0)
    target = multisine(Clock(5001, 5000.0), np.random.default_rng([6, 6, 7]), (0.1, 1.6), 0.014)
    assert nrmse(whole["position"], target) < 0.05
    assert nrmse(case.simulated(0, effect=False)["position"], target) > 0.05


def of_the_bench(model, signal, load, seconds=2.0):
    """What a model of the bench does under a load that ``load(data, t)`` sets in the middle of each step, with its times [s]."""
    model.opt.integrator = mujoco.mjtIntegrator.mjINT_RK4
    data, h, seen = mujoco.MjData(model), model.opt.timestep, []
    for i in range(round(seconds / h)):
        seen.append(data.qvel[0] if signal == "speed" else data.qpos[0])
        load(data, (i + 0.5) * h)
        mujoco.mj_step(model, data)
    return np.arange(len(seen)) * h, np.array(seen)


def nominal(case, loads):
    """Signals of the rig as its nominal model has it, under loads at each step."""
    exact = {name: p._replace(std=0.0) for name, p in case.parameters.items()}
    values = replace(case, parameters=exact).truth(effect=False, background=False)
    return case.simulate(Run(values, loads, case.step(), 0.0))


@pytest.mark.parametrize(
    ("case", "signal", "size", "late"),
    [
        (STAGE, "position", 5.0, 2e-4),  # its drive lags behind, also where nothing is missing
        (turning.ROTOR, "speed", 1.0, 0.0),
        (turning.PENDULUM, "angle", 0.5, 0.0),
        (chains.FLOOR, "deformation_1", 60.0, 0.0),
    ],
    ids=["stage", "rotor", "pendulum", "floor"],
)
def test_model_of_the_bench_moves_as_the_rig_does(case, signal, size, late):
    t = times(case)
    loads = size * sines(t)[:, None]
    if case is chains.FLOOR:
        loads = np.hstack([np.zeros_like(loads), loads])
    found = nominal(case, loads)[signal]

    def load(data, now):
        data.qfrc_applied[0] = size * sines(now - late)

    clock, seen = of_the_bench(mujoco.MjModel.from_xml_string(case.model), signal, load)
    assert nrmse(seen, np.interp(clock, t, found)) < 1e-3


def test_frame_of_the_bench_moves_on_its_table_as_the_rig_does():
    case = chains.FRAME
    t = times(case)
    found = nominal(case, np.column_stack([sines(t), np.zeros(len(t))]))["deformation_1"]
    # seen from the table, its acceleration is a gravity
    still = case.model.replace('<joint name="table" type="slide" axis="1 0 0"/>', "")
    model = mujoco.MjModel.from_xml_string(still)
    assert model.nv == 2

    def load(data, now):
        model.opt.gravity[0] = -sines(now)

    clock, seen = of_the_bench(model, "deformation_1", load)
    assert nrmse(seen, np.interp(clock, t, found)) < 1e-3


def test_brake_of_the_pendulum_is_on_one_side():
    p = turning.Pendulum(0.1, 0.0, 0.001, 0.06, np.radians(4.0), np.radians(10.0), 0.0, 0.0)
    still = straight(np.zeros((2, 1)))

    def damping(degrees):
        state = np.array([np.radians(degrees), 2.0])
        return -0.1 * turning.pendulum_march(p, state, still, 1e-6).rate[0, 1] / 2.0

    found = [damping(degrees) for degrees in (10.0, 14.0, 6.0, -10.0)]
    np.testing.assert_allclose(
        found, [0.061, 0.001 + 0.06 / np.e, 0.001 + 0.06 / np.e, 0.001], rtol=0.0, atol=1e-9
    )


def test_pendulum_is_let_go_and_loses_its_swing():
    case = short(turning.PENDULUM, 4.0)
    for number, start in enumerate((36.0, -21.0, 29.0)):
        angle = case.simulated(number)["angle"]
        assert np.degrees(angle[0]) == pytest.approx(start)
        assert np.max(np.abs(angle[-4000:])) < abs(angle[0])
        assert nrmse(case.simulated(number, effect=False)["angle"], angle) > 0.05


def test_torque_on_the_rotor_is_what_turns_and_drags_it():
    case = short(turning.ROTOR, 10.0)
    found, p = case.simulated(0), case.truth()
    v, angle = found["speed"], np.cumsum(found["speed"]) * case.step()
    drag = (p["damping"] + 6.5e-5 * np.abs(v)) * v + 0.012 * np.tanh(v / 0.2) - 0.01 * np.sin(angle)
    left = found["load"] - drag - p["inertia"] * found["acceleration"]
    # the angle is summed up from the speed, which blurs the ripple a little
    assert np.max(np.abs(left)) < 2e-3


def test_damper_is_harder_one_way():
    p = dampers.Damper(100.0, 1000.0, 20.0, asymmetry=0.24, fall=0.1)
    x, v = np.array([0.0, 0.0, 0.01]), np.array([0.5, -0.5, 0.0])
    found = dampers.damper_force(p, x, v)
    np.testing.assert_allclose(found, [620.0 * 0.95 + 20.0, -380.0 * 0.95 - 20.0, 1.0])


def test_film_of_silicone_warms_and_thins():
    case = dampers.ROTARY
    t, p = times(case, 4.0), case.truth(background=False)
    angle = 0.5 * np.sin(2 * np.pi * 2.0 * t)

    def derivative(now, s):
        speed = 2 * np.pi * np.cos(2 * np.pi * 2.0 * now)
        return p["damping"] * np.exp(-0.035 * s) * speed**2 / 12.0 - s / 8.0

    found = run(case, angle)
    warmth = solved(derivative, 1, t)[0]
    np.testing.assert_allclose(found["warmth"], warmth, rtol=0.0, atol=1e-5 * np.max(warmth))
    speed = 2 * np.pi * np.cos(2 * np.pi * 2.0 * t)
    torque = p["stiffness"] * angle + p["damping"] * np.exp(-0.035 * warmth) * speed
    np.testing.assert_allclose(found["torque"][2:-2], torque[2:-2], rtol=0.0, atol=1e-4)
    assert np.exp(-0.035 * warmth[-1]) < 0.9


def test_signals_have_their_size_and_band():
    clock, rng = Clock(20_001, 1000.0), np.random.default_rng(3)
    time = clock.times()
    late = slice(10_000, 20_000)  # one period of the sines, after their rise
    tones = multisine(clock, rng, (2.0, 9.0), 5.0)[late]
    assert np.std(tones) == pytest.approx(5.0, rel=1e-9)
    power = np.abs(np.fft.rfft(tones)) ** 2
    assert power[20:91].sum() == pytest.approx(power.sum(), rel=1e-9)
    noise = band_noise(clock, rng, (2.0, 9.0), 5.0)
    assert np.std(noise[1000:]) == pytest.approx(5.0, rel=0.1)
    assert np.all(noise[:400] == 0.0)
    assert np.std(quake(clock, rng, 1.5)) == pytest.approx(1.5, rel=1e-9)
    stairs = levels(clock, (1.0, -2.0, 0.5), 0.5)
    np.testing.assert_allclose(stairs[[0, 3000, 12_000, 20_000]], [0.0, 1.0, -2.0, 0.5])
    np.testing.assert_allclose(rate_of(time**4, 1000.0)[2:-2], 4.0 * time[2:-2] ** 3, atol=1e-6)


def test_noise_has_the_stated_size_and_colour():
    rng = np.random.default_rng(1)
    assert np.std(disturbed(rng, 200_000, 0.002, 0.3)) == pytest.approx(1.0, rel=0.02)
    slow = disturbed(rng, 200_000, 0.002, 1.0)
    pole = np.exp(-2 * np.pi * 3.0 * 0.002)
    assert np.mean(slow[1:] * slow[:-1]) / np.var(slow) == pytest.approx(pole, rel=0.01)
    t = jittered(rng, 10_000, 0.1)
    assert np.std(t - np.arange(10_000) * 0.1) == pytest.approx(1e-3, rel=0.03)
    assert t[0] >= 0.0


def test_a_record_is_the_signal_in_its_unit_with_noise_and_steps():
    t, rng = np.arange(2000) * 0.01, np.random.default_rng(2)
    signal = np.linspace(0.0, 2.0, 20_001)
    plain = read(Channel("x", "mm", scale=1e3), signal, 1e-3, t, rng)
    np.testing.assert_allclose(plain, 1e3 * t / 10.0, rtol=0.0, atol=1e-6)
    coarse = read(Channel("x", "mm", scale=1e3, resolution=0.5), signal, 1e-3, t, rng)
    np.testing.assert_array_equal(coarse, np.round(plain / 0.5) * 0.5)
    noisy = read(Channel("x", "mm", 3.0, 1e3), signal, 1e-3, t, rng)
    assert np.std(noisy - plain) == pytest.approx(3.0, rel=0.1)


def test_a_command_is_logged_as_it_was_asked_for():
    case = short(STAGE, 1.0)
    table = logged(case, 0, case.simulated(0))
    np.testing.assert_allclose(table.columns["force_command"], case.loads[0][:-1:10, 0], rtol=0.0, atol=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES, ids=[case.name for case in CASES])
def test_every_case_holds_its_effect_and_is_read(case, tmp_path):
    case = short(case)
    write_case(case, tmp_path)
    read = read_case(tmp_path)
    assert (len(read.identification), len(read.validation)) == (2, 1)
    assert {channel.name for channel in read.channels} >= set(case.channels)
    assert set(case.left) == set(case.responses)

    def together(signal, **parts):
        return np.concatenate([case.simulated(number, **parts)[signal] for number in range(3)])

    for name in case.responses:
        signal = case.channels[name].signal
        full = together(signal)
        assert nrmse(together(signal, background=False), full) > 0.0
        assert (nrmse(together(signal, effect=False), full) > 0.0) == bool(case.missing)


def test_true_values_are_off_by_their_uncertainty():
    for case in CASES:
        drawn = case.drawn()
        for name, p in case.parameters.items():
            off = abs(drawn[name] / p.factor - p.value)
            assert 0.0 < off <= 1.5 * p.std * (1.0 + 1e-9)


def test_acceptance_holds_every_case(tmp_path):
    write_acceptance(CASES, tmp_path)
    told = acceptances(tmp_path / "acceptance.json")
    assert len(told) == len(CASES) == 10
    assert [case.number for case in CASES] == list(range(1, 11))
    known = {effect.name for effect in CATALOGUE}
    table = (tmp_path / "README.md").read_text()
    assert table == overview(CASES)
    for case in CASES:
        entry = told[case.name]
        assert case.name.startswith("sixth_")
        assert known >= {name.partition("@")[0] for name in entry.also.union(*entry.right)}, case.name
        assert bool(entry.right) != case.why.startswith("foreign")
        assert case.why == entry.why
        assert f"| {case.name} | {case.tested} | {case.why} |" in table
        assert all(f"| {case.name} | {name} |" in table for name in case.responses)


def test_a_run_is_reproducible(tmp_path):
    case = short(turning.PENDULUM)
    for folder, made in (("one", case), ("again", case), ("other", replace(case, number=11))):
        write_case(made, tmp_path / folder)
    files = sorted(path.name for path in (tmp_path / "one").iterdir())
    one, again, other = (
        [(tmp_path / folder / name).read_bytes() for name in files] for folder in ("one", "again", "other")
    )
    assert len(files) == 5
    assert one == again
    assert one != other
    assert json.loads((tmp_path / "one" / "nominal.json").read_text())["starts_in_motion"]
