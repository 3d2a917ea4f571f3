"""Rigs: immutability, channels, drives, records, and errors that say what to do."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

from bench import Element, Excitation, Rig, simulate, simulate_batch
from bench.errors import ModelError, ParameterError, RangeWarning, SimulationError, UnknownNameError
from bench.laws import LAWS
from bench.laws.coupling import INCH, POUND_FORCE
from bench.rig.library import damper_rig, joint_rig, prescribe, sdof_rig, starting
from bench.signals import Harmonic

GAP = Element.of("gap", "carriage", stiffness=3000.0, clearance=0.005)


def harmonic(amplitude: float = 5.0, duration: float = 2.0) -> Excitation:
    return Excitation(
        {"shaker": Harmonic(amplitude=amplitude, frequency=2.0)}, duration=duration, sample_rate=1000.0
    )


def test_linear_rig_follows_the_analytic_free_decay():
    mass, stiffness, damping = 2.0, 800.0, 3.0
    rig = sdof_rig(mass=mass, stiffness=stiffness, damping=damping)
    record = simulate(rig, {"shaker": np.zeros(1000)}, initial={"carriage": (0.01, 0.0)})
    decay = damping / (2.0 * mass)
    omega = np.sqrt(stiffness / mass - decay**2)
    t = record.time
    expected = 0.01 * np.exp(-decay * t) * (np.cos(omega * t) + decay / omega * np.sin(omega * t))
    # RK4 at omega dt = 0.02: (omega dt)^4 / 120 a step, over 20 radians
    assert np.max(np.abs(record["displacement"] - expected)) < 1e-9


def test_channels_balance_the_equation_of_motion_at_every_sample():
    rig = sdof_rig(GAP, mass=2.0, stiffness=500.0, damping=3.0)
    record = simulate(rig, harmonic(20.0))
    assert np.ptp(record["carriage.gap/force"]) > 0.0
    residual = (
        2.0 * record["acceleration_x"]
        + 3.0 * record["velocity"]
        + 500.0 * record["displacement"]
        + record["carriage.gap/force"]
        - record["shaker"]
    )
    assert np.max(np.abs(residual)) < 1e-9 * np.max(np.abs(record["shaker"]))


def test_units_and_quantities_of_channels():
    channels = {channel.name: channel for channel in joint_rig().channels}
    assert channels["force"].unit == "N"
    assert channels["torque"].unit == "N m"
    assert channels["force"].role == "command"
    assert channels["displacement_1"].unit == "m"
    assert channels["rotation_2"].unit == "rad"
    assert channels["joint/force_1"].unit == "N"
    assert channels["joint/force_2"].unit == "N m"
    assert channels["joint/velocity_2"].unit == "rad/s"


def test_swapping_the_joint_leaves_the_original_alone():
    rig = sdof_rig(GAP)
    other = rig.with_element(GAP.with_(clearance=0.001))
    assert rig.elements[0].parameters["clearance"] == 0.005
    assert other.elements[0].parameters["clearance"] == 0.001
    assert len(other.elements) == 1
    with pytest.raises(ValueError, match="read-only"):
        rig.elements[0].theta[0] = 1.0


def test_batch_equals_single_runs_to_the_bit_for_any_thread_count():
    rigs = [sdof_rig(GAP.with_(clearance=c), mass=2.0, stiffness=500.0) for c in (0.001, 0.003, 0.01)]
    drives = [harmonic(a) for a in (5.0, 10.0, 20.0)]
    singles = [simulate(rig, drive) for rig, drive in zip(rigs, drives, strict=True)]
    for threads in (1, 2):
        batch = simulate_batch(rigs, drives, threads=threads)
        for one, many in zip(singles, batch, strict=True):
            assert np.array_equal(one.values, many.values)


def test_same_seed_same_record_and_other_seed_other_record():
    from bench.signals import BandLimitedNoise

    noise = Excitation({"shaker": BandLimitedNoise(cutoff=20.0)}, duration=1.0, sample_rate=1000.0)
    a, b, c = (simulate(sdof_rig(), noise, rng=np.random.default_rng(seed)) for seed in (1, 1, 2))
    assert np.array_equal(a.values, b.values)
    assert not np.array_equal(a.values, c.values)


def test_record_at_a_lower_rate_is_every_nth_sample():
    rig = sdof_rig(GAP, stiffness=500.0)
    full, thin = simulate(rig, harmonic()), simulate(rig, harmonic(), sample_rate=250.0)
    assert np.array_equal(full.values[::4], thin.values)
    assert thin.sample_rate == 250.0


def test_exact_stick_holds_a_load_that_the_regularised_law_creeps_under():
    friction = Element.of("coulomb", "carriage", limit=5.0)
    hold = {"shaker": np.full(2000, 4.0)}
    creep = simulate(sdof_rig(friction), hold)["displacement"][-1]
    stick = simulate(sdof_rig(friction.with_(exact=True)), hold)["displacement"][-1]
    speed = friction.parameters["regularisation_velocity"] * np.arctanh(0.8)
    assert creep == pytest.approx(2.0 * speed, rel=0.01)  # v = vr artanh(F / Fc), as the law states
    assert abs(stick) < 0.01 * creep
    slide = simulate(sdof_rig(friction.with_(exact=True)), {"shaker": np.full(1000, 8.0)})
    # Euler integration of the constraint: velocity 3 t, position off by at most v dt
    assert slide["velocity"][-1] == pytest.approx(3.0 * slide.time[-1], rel=5e-3)


def test_prescribed_motion_is_followed_under_load():
    damper = Element.of("linear_damping", "piston", damping=2.0e5)
    rig = damper_rig(damper)
    t = np.arange(2048) * rig.timestep
    x = 0.02 * (1.0 - np.cos(2.0 * np.pi * t))
    record = simulate(rig, prescribe(rig, x), initial=starting(rig, x))
    assert np.max(np.abs(record["displacement"] - x)) < 1e-4 * np.ptp(x)
    peak = 2.0e5 * 0.02 * 2.0 * np.pi
    assert np.max(np.abs(record["piston.linear_damping/force"])) == pytest.approx(peak, rel=1e-3)


def test_deck_joint_rig_has_the_decks_frequency():
    """Two bodies of mass 2 on mounts of 1000, joined by 200 within the gap: in-phase sqrt(500), out of phase sqrt(700)."""
    import mujoco

    rig = joint_rig(Element.of("linear", "axial", stiffness=200.0 * POUND_FORCE / INCH, damping=0.0))
    model, data = rig.model, mujoco.MjData(rig.model)
    columns = []
    for joint in ("axial_1", "axial_2"):
        mujoco.mj_resetData(model, data)
        data.joint(joint).qpos = 1e-3
        mujoco.mj_forward(model, data)
        columns.append([data.joint(name).qacc[0] / -1e-3 for name in ("axial_1", "axial_2")])
    eigenvalues = np.sort(np.linalg.eigvals(np.array(columns).T).real)
    np.testing.assert_allclose(eigenvalues, [500.0, 700.0], rtol=1e-9)


def test_divergence_names_time_element_and_last_good_state(tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    stiff = Element.of("linear", "carriage", stiffness=-1e9, damping=0.0, name="wrong sign")
    with pytest.raises(
        SimulationError, match=r"diverged after t = .*carriage = .*'wrong sign'.*timestep"
    ) as caught:
        simulate(sdof_rig(stiff), harmonic())
    assert caught.value.element == "wrong sign"
    assert 0.0 < caught.value.time < 2.0
    assert list(tmp_path.iterdir()) == []  # MuJoCo's own log would lie here
    assert "WARNING" not in capfd.readouterr().err


def test_leaving_the_validity_range_warns():
    class Box:
        def outside(self, states):
            return np.abs(states[:, 0]) > 1e-3

    reduced = Element.of("linear", "carriage", stiffness=100.0).with_(validity=Box())
    with pytest.warns(RangeWarning, match="outside the range it was identified on"):
        simulate(sdof_rig(reduced, mass=1.0), harmonic(20.0))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        simulate(sdof_rig(reduced, mass=1.0), harmonic(1e-4))


@pytest.mark.parametrize(
    ("make", "error", "message"),
    [
        (lambda: Element.of("gapp", "carriage"), UnknownNameError, "unknown law 'gapp'.*Did you mean 'gap'"),
        (
            lambda: Element.of("gap", "carriage", width=1.0),
            UnknownNameError,
            "unknown parameter of law 'gap' 'width'",
        ),
        (
            lambda: Element.of("gap", "carriage", clearance=-1.0),
            ParameterError,
            "'clearance' of law 'gap' is -1",
        ),
        (
            lambda: Element.of("gap", "carriage", stiffness=np.nan),
            ParameterError,
            "is nan N/m; a finite value",
        ),
        (lambda: Element.of("gap", "a", "b"), ParameterError, r"acts on 1 joint\(s\)"),
        (
            lambda: Element.of("stribeck", "carriage", exact=True),
            ParameterError,
            "exact stick is MuJoCo's frictionloss",
        ),
        (lambda: sdof_rig(GAP, GAP), ModelError, "elements of the same name"),
        (lambda: sdof_rig(integrator="RK5"), UnknownNameError, "unknown integrator 'RK5'"),
        (lambda: sdof_rig(timestep=0.0), ParameterError, "timestep of rig 'sdof' is 0.0 s"),
        (lambda: sdof_rig(mass=-1.0).model, ParameterError, "mass of 'carriage' is -1.0"),
        (lambda: sdof_rig().with_structure(masss={"a": 1.0}), UnknownNameError, "Did you mean 'mass'"),
        (
            lambda: Rig("broken", "<mujoco><worldbody>").model,
            ModelError,
            "MJCF of rig 'broken' cannot be read",
        ),
        (lambda: Rig.from_file("nowhere.xml"), ModelError, "cannot read the model nowhere.xml"),
        (lambda: simulate(sdof_rig(), {"shakr": np.zeros(5)}), UnknownNameError, "Did you mean 'shaker'"),
        (
            lambda: simulate(sdof_rig(), {"shaker": np.array([0.0, np.nan])}),
            ParameterError,
            "is nan at sample 1",
        ),
        (lambda: simulate(sdof_rig(), {"shaker": np.zeros(0)}), ParameterError, "no samples"),
        (lambda: simulate(sdof_rig(), {"shaker": np.zeros((5, 2))}), ParameterError, r"shape \(5, 2\)"),
        (lambda: simulate(sdof_rig(), {"shaker": 3.0}), ParameterError, r"shape \(\)"),
        (lambda: simulate(sdof_rig(), {"shaker": ["a"]}), ParameterError, "no array of real numbers"),
        (lambda: simulate(sdof_rig(), {}), ParameterError, "has no channels"),
        (lambda: simulate(sdof_rig(), np.zeros(5)), ParameterError, "is a ndarray"),
        (
            lambda: simulate(sdof_rig(), {"shaker": np.zeros(5)}, initial={"carriage": (np.nan, 0.0)}),
            ParameterError,
            "initial state of joint 'carriage'",
        ),
        (lambda: simulate(sdof_rig(timestep=3e-3), harmonic()), ParameterError, "does not divide"),
        (lambda: prescribe(sdof_rig(), np.zeros(20)), ModelError, "cannot follow a prescribed motion"),
    ],
)
def test_bad_input_is_refused_with_a_clear_message(make, error, message):
    with pytest.raises(error, match=message):
        make()


def test_element_json_round_trip():
    for law in LAWS.values():
        moving = law.n_coordinates - law.n_inputs
        element = Element.of(
            law, *(f"j{i}" for i in range(moving)), inputs=tuple(f"u{i}" for i in range(law.n_inputs))
        )
        again = Element.from_dict(element.to_dict())
        assert again.law == element.law
        assert np.array_equal(again.theta, element.theta)
        assert (again.joints, again.inputs, again.name) == (element.joints, element.inputs, element.name)


@pytest.mark.parametrize(
    "rig", [sdof_rig(GAP, stiffness=500.0), joint_rig(), damper_rig()], ids=lambda rig: rig.name
)
def test_what_is_only_drawn_is_left_out_of_the_simulation_and_changes_no_bit(rig):
    import mujoco

    assert rig.scene.ngeom > rig.model.ngeom == 0
    ends = []
    for model in (rig.model, rig.scene):
        data = mujoco.MjData(model)
        data.qvel[:] = np.linspace(0.1, 0.2, model.nv)
        mujoco.mj_step(model, data, 200)
        ends.append(np.concatenate([data.qpos, data.qvel, data.sensordata]))
    assert np.array_equal(*ends)
