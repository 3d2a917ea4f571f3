"""Output-error fits and the compiled loop behind them: equality with MuJoCo, recovery, honest uncertainties."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest

from bench import Element, Recording, Rig, chain_rig, joint_rig, laboratory_joint_rig, sdof_rig, simulate
from bench.errors import IdentificationError, ModelError, ParameterError, UnknownNameError
from bench.identification.linear_rig import LinearRig, current
from bench.identification.output_error import fit_output_error
from bench.rig.library import six_dof_rig, true_joint
from bench.signals import BandLimitedNoise, Excitation

FREE: tuple[str, ...] = (
    "structure/mass/carriage",
    "structure/damping/carriage",
    "structure/stiffness/carriage",
    "joint/A",
    "joint/beta",
    "joint/gamma",
)
TRUE = {
    "structure/mass/carriage": 2.0,
    "structure/damping/carriage": 4.0,
    "structure/stiffness/carriage": 1500.0,
    "joint/A": 2000.0,
    "joint/beta": 120.0,
    "joint/gamma": 80.0,
}
NOISE = {"displacement": 1e-4, "velocity": 3e-3}
CHANNELS = tuple(NOISE)


def _rig(values: Mapping[str, float] = TRUE, factor: float = 1.0, **settings) -> Rig:
    m, c, k, A, beta, gamma = (factor * values[name] for name in FREE)
    joint = Element.of("bouc_wen", "carriage", name="joint", A=A, beta=beta, gamma=gamma)
    return sdof_rig(joint, mass=m, damping=c, stiffness=k, **settings)


def _record(rng: np.random.Generator, duration: float = 4.0, *, noisy: bool = False) -> Recording:
    drive = Excitation({"shaker": BandLimitedNoise(cutoff=12.0, peak=60.0)}, duration, 1000.0)
    record = simulate(_rig(), drive, rng=rng).select(["shaker", *CHANNELS])
    if not noisy:
        return record
    values = {name: record[name] + std * rng.standard_normal(len(record)) for name, std in NOISE.items()}
    return record.with_channels(values, noise_std=NOISE)


RIGS = {
    "sdof": (
        sdof_rig(
            Element.of("bouc_wen", "carriage"),
            Element.of("gap", "carriage", clearance=0.01),
            stiffness=900.0,
            damping=3.0,
        ),
        ("displacement", "velocity", "acceleration_x"),
        30.0,
    ),
    "friction with an input": (
        sdof_rig(Element.of("controlled_friction", "carriage", inputs=("normal_force",)), stiffness=900.0),
        ("displacement", "velocity"),
        30.0,
    ),
    "joint": (joint_rig(), ("axial", "rotation_2", "acceleration_1_x", "angular_acceleration_2_x"), 1e3),
    "laboratory joint": (
        laboratory_joint_rig(true_joint()), ("axial", "rotation_2", "acceleration_1_x"), 3.0,
    ),
    "chain": (chain_rig(Element.of("gap", "axial_23", clearance=1e-4)), (), 1e3),
}  # fmt: skip


@pytest.mark.parametrize("name", RIGS)
def test_compiled_loop_equals_mujoco(name, rng):
    rig, channels, level = RIGS[name]
    if not channels:
        first = len(rig.actuators)
        channels = [
            c.name for c in rig.channels[first : first + rig.model.nsensordata] if c.unit in {"m", "rad"}
        ]
    drive = {actuator: level * rng.standard_normal(1500) for actuator in rig.actuators}
    record = simulate(rig, drive)
    found = LinearRig.of(rig, channels).simulate(np.stack(list(drive.values()), axis=1))
    expected = np.stack([record[channel] for channel in channels], axis=1)
    assert np.max(np.abs(expected)) > 0.0
    # rounding of 1e-16 a step, over 1500 steps and magnified where friction or a gap turns a difference in time to force
    assert np.max(np.abs(found - expected) / np.max(np.abs(expected), axis=0, initial=1e-12)) < 1e-9


def test_free_structure_and_element_parameters_enter_as_in_a_rebuilt_rig(rng):
    values = dict(zip(FREE, [2.6, 5.5, 1100.0, 2500.0, 100.0, 60.0], strict=True))
    drive = {"shaker": 30.0 * rng.standard_normal(800)}
    record = simulate(_rig(values), drive)
    compiled = LinearRig.of(_rig(), CHANNELS, FREE)
    controls = np.stack([drive["shaker"], np.zeros(800)], axis=1)
    found = compiled.simulate(controls, list(values.values()))
    expected = np.stack([record[name] for name in CHANNELS], axis=1)
    np.testing.assert_allclose(found, expected, atol=1e-10 * np.max(np.abs(expected)))


WHEEL = """<mujoco><option gravity="0 0 0" timestep="0.001" integrator="RK4"/><worldbody><body name="wheel">
<joint name="mesh" axis="0 0 1" stiffness="390" damping="0.14"/><inertial pos="0 0 0" mass="5" diaginertia="0.008 0.009 0.0117"/></body>
</worldbody><actuator><motor name="exciter" joint="mesh"/></actuator><sensor><jointpos name="twist" joint="mesh"/></sensor></mujoco>"""


def test_an_inertia_is_that_about_the_hinge_whatever_the_others_are(rng):
    rig, name, heavier = Rig("wheel", WHEEL), "structure/inertia/wheel", 1.03 * 0.0117
    assert current(rig, name) == pytest.approx(0.0117)
    moved = rig.with_structure(inertia={"wheel": heavier})
    np.testing.assert_allclose(moved.model.body_inertia[1], 1.03 * np.array([0.008, 0.009, 0.0117]))
    record = simulate(moved, {"exciter": rng.standard_normal(800)})
    found = LinearRig.of(rig, ["twist"], [name]).simulate(record["exciter"][:, None], [heavier])
    scale = np.max(np.abs(record["twist"]))
    np.testing.assert_allclose(found[:, 0], record["twist"], atol=1e-10 * scale)
    for engine in ("linear", "mujoco"):
        fitted = fit_output_error(rig, [record], free=[name], engine=engine)
        assert fitted.parameters[name] == pytest.approx(heavier, rel=1e-6)


def test_controlled_error_follows_the_analytic_free_decay():
    m, c, k, v0 = 2.0, 3.0, 900.0, 1.0
    rig = LinearRig.of(sdof_rig(mass=m, damping=c, stiffness=k, timestep=0.02), ["displacement"])
    zeros = np.zeros((100, 2))
    t = 0.02 * np.arange(100)
    decay = c / (2 * m)
    omega = np.sqrt(k / m - decay**2)
    exact = v0 / omega * np.exp(-decay * t) * np.sin(omega * t)
    errors = [
        np.max(np.abs(rig.simulate(zeros, initial={"carriage": (0.0, v0)}, tolerance=tol)[:, 0] - exact)) / v0 * omega
        for tol in (1e-5, 1e-7, 1e-9)
    ]  # fmt: skip
    # local errors add up over some 200 steps: a factor of 30 above the tolerance is plenty, and they fall with it
    assert all(error < 30.0 * tol for error, tol in zip(errors, (1e-5, 1e-7, 1e-9), strict=True))
    assert errors[2] < 1e-2 * errors[0]


PENDULUM = """<mujoco><option gravity="0 0 -9.81"/><worldbody><body name="bob"><joint name="swing" type="hinge"
axis="0 1 0"/><geom type="sphere" size=".1" pos="0 0 -.5" contype="0" conaffinity="0"/></body></worldbody>
<actuator><motor name="push" joint="swing"/></actuator><sensor><jointpos name="angle" joint="swing"/></sensor></mujoco>"""


@pytest.mark.parametrize(
    ("rig", "reason"),
    [
        (Rig("pendulum", PENDULUM), "not linear in position"),
        (six_dof_rig(), "linear structure"),
        (sdof_rig(Element.of("coulomb", "carriage", exact=True)), "dry friction"),
        (sdof_rig(integrator="Euler"), "RK4"),
        (
            Rig("stop", PENDULUM.replace('type="hinge"', 'type="slide" range="0 1" limited="true"')),
            "limited",
        ),
    ],
    ids=["pendulum", "six dof", "exact friction", "Euler", "stop"],
)
def test_rig_that_is_not_linear_is_refused(rig, reason):
    channels = ["angle"] if "angle" in rig.mjcf else [rig.channels[len(rig.actuators)].name]
    with pytest.raises(ModelError, match=reason):
        LinearRig.of(rig, channels)


def test_recovery_without_noise_is_exact(rng):
    fit = fit_output_error(_rig(factor=1.2), [_record(rng)], free=FREE)
    assert fit.engine == "linear"
    for name in (
        FREE
    ):  # the residuals end at rounding, 1e-14 of the motion; beta is determined a thousand times worse
        assert fit.parameters[name] == pytest.approx(TRUE[name], rel=1e-8)
        assert current(fit.rig, name) == fit.parameters[name]


def test_recovery_with_noise_predicts_held_out_excitation_and_states_its_uncertainty(rng):
    record = _record(rng, 8.0, noisy=True)
    fit = fit_output_error(_rig(factor=0.8), [record], free=FREE)
    for name in FREE:  # six normal deviates: beyond four standard deviations once in three thousand seeds
        assert abs(fit.parameters[name] - TRUE[name]) < 4.0 * fit.std[name]
    # whitened residuals of 16 000 samples: their variance is 1 within 4 * sqrt(2 / 16 000)
    assert 2.0 * fit.cost / 16_000 == pytest.approx(1.0, abs=0.045)
    unseen = Excitation({"shaker": BandLimitedNoise(cutoff=20.0, peak=50.0)}, 4.0, 1000.0)
    true, found = (simulate(rig, unseen, rng=np.random.default_rng(9)) for rig in (_rig(), fit.rig))
    for channel, std in NOISE.items():  # the fit averages the noise of thousands of samples away
        assert np.sqrt(np.mean((true[channel] - found[channel]) ** 2)) < 0.1 * std


def test_standard_deviations_are_those_of_repeated_experiments(rng):
    """Forty fits to forty draws of noise: their scatter has a relative error of 1/sqrt(80) = 0.11."""
    free = ("structure/mass/carriage", "structure/stiffness/carriage")
    rig = sdof_rig(mass=2.0, damping=4.0, stiffness=1500.0)
    clean = simulate(rig, {"shaker": 30.0 * rng.standard_normal(500)}).select(["shaker", "displacement"])
    fits = []
    for _ in range(40):
        noisy = clean.with_channels({"displacement": clean["displacement"] + 1e-4 * rng.standard_normal(500)})
        fits.append(fit_output_error(rig, [noisy], free=free, channels=["displacement"], threads=1))
    for name in free:
        scatter = np.std([fit.parameters[name] for fit in fits], ddof=1)
        stated = np.mean([fit.std[name] for fit in fits])
        assert 0.6 < scatter / stated < 1.5


def test_engines_and_thread_counts_agree(rng):
    record = _record(rng, 1.0, noisy=True)
    one, two = (fit_output_error(_rig(factor=1.1), [record], free=FREE, threads=n) for n in (1, 2))
    slow = fit_output_error(_rig(factor=1.1), [record], free=FREE, engine="mujoco")
    assert one.parameters == two.parameters
    assert slow.engine == "mujoco"
    for (
        name
    ) in FREE:  # both end where the cost falls by less than 1e-9 of itself: far inside the standard deviation
        assert abs(slow.parameters[name] - one.parameters[name]) < 1e-3 * one.std[name]


def test_nonlinear_rig_is_fitted_with_mujoco(rng):
    true = Rig("pendulum", PENDULUM).with_structure(damping={"swing": 0.4})
    record = simulate(true, {"push": 30.0 * rng.standard_normal(1500)})
    start = true.with_structure(damping={"swing": 0.7})
    fit = fit_output_error(start, [record], free=["structure/damping/swing"])
    assert fit.engine == "mujoco"
    assert fit.parameters["structure/damping/swing"] == pytest.approx(0.4, rel=1e-8)


def test_records_at_lower_rate_with_other_names_and_initial_motion_are_understood(rng):
    drive = Excitation({"shaker": BandLimitedNoise(cutoff=12.0, peak=60.0)}, 4.0, 250.0)
    initial = {"carriage": (0.01, -0.2)}
    record = simulate(_rig(), drive, rng=rng, sample_rate=250.0, initial=initial)
    record = record.select(["shaker", *CHANNELS]).renamed({"shaker": "load"})
    fit = fit_output_error(_rig(factor=1.1), [record], free=FREE, inputs={"shaker": "load"}, initial=initial)
    assert fit.parameters["joint/A"] == pytest.approx(2000.0, rel=1e-8)


def test_settle_is_simulated_and_not_fitted(rng):
    record = _record(rng)
    spoilt = record["displacement"].copy()
    spoilt[:500] += 1.0
    fit = fit_output_error(
        _rig(factor=1.1), [record.with_channels({"displacement": spoilt}).with_(settle=0.5)], free=FREE
    )
    assert fit.parameters["joint/A"] == pytest.approx(2000.0, rel=1e-8)
    assert fit.residuals[0].shape == (4000, 2)


def test_further_starts_leave_a_poor_one(rng):
    """From a tenth of the stiffness the response is out of phase, and the nearest minimum is not the true one."""
    record = _record(rng)
    start = _rig({**TRUE, "structure/stiffness/carriage": 30_000.0, "joint/A": 100.0})
    search = {"structure/stiffness/carriage": (300.0, 30_000.0), "joint/A": (100.0, 10_000.0)}
    alone = fit_output_error(start, [record], free=FREE, max_iterations=30)
    found = fit_output_error(start, [record], free=FREE, search=search, starts=4, rng=rng, max_iterations=30)
    assert found.cost < 1e-6 * alone.cost
    assert found.parameters["structure/stiffness/carriage"] == pytest.approx(1500.0, rel=1e-6)


def test_prior_and_bound_are_kept(rng):
    record = _record(rng, 1.0, noisy=True)
    tight = fit_output_error(_rig(), [record], free=FREE, priors={"joint/gamma": (95.0, 1e-3)})
    assert tight.parameters["joint/gamma"] == pytest.approx(95.0, abs=4e-3)
    bounded = fit_output_error(_rig(), [record], free=FREE, bounds={"joint/A": (0.0, 1900.0)})
    assert bounded.parameters["joint/A"] <= 1900.0
    free = fit_output_error(_rig(), [record], free=FREE)
    assert tight.cost > free.cost
    assert bounded.cost > free.cost
    assert bounded.std["joint/A"] == 0.0


def test_parameter_that_the_record_does_not_determine_has_infinite_deviation(rng):
    idle = Element.of("gap", "carriage", name="stop", clearance=10.0)
    rig = sdof_rig(idle, mass=2.0, damping=4.0, stiffness=1500.0)
    record = simulate(rig, {"shaker": 30.0 * rng.standard_normal(500)})
    fit = fit_output_error(rig, [record], free=["structure/mass/carriage", "stop/stiffness"])
    assert np.isinf(fit.std["stop/stiffness"])
    assert np.isfinite(fit.std["structure/mass/carriage"])


@pytest.mark.parametrize(
    ("changes", "error"),
    [
        ({"free": ["joint/B"]}, UnknownNameError),
        ({"free": ["link/A"]}, UnknownNameError),
        ({"free": ["structure/mass/wagon"]}, UnknownNameError),
        ({"free": ["structure/colour/carriage"]}, UnknownNameError),
        ({"free": []}, IdentificationError),
        ({"channels": ["strain"]}, UnknownNameError),
        ({"inputs": {"hammer": "shaker"}}, UnknownNameError),
        ({"priors": {"joint/A": (1.0, 1.0)}}, IdentificationError),
        ({"noise": {"strain": 1.0}}, UnknownNameError),
        ({"starts": 3}, ParameterError),
        ({"engine": "fast"}, UnknownNameError),
        ({"initial": [{}, {}]}, IdentificationError),
        ({"initial": {"wagon": (0.0, 0.0)}}, UnknownNameError),
        ({"bounds": {"joint/n": (1.0, 2.0)}}, UnknownNameError),
    ],
)
def test_what_does_not_fit_is_refused(changes, error, rng):
    with pytest.raises(error):
        fit_output_error(_rig(), [_record(rng, 0.5)], **({"free": FREE} | changes))


def test_channel_that_never_moves_is_refused(rng):
    record = _record(rng, 0.5)
    still = record.with_channels({"velocity": np.zeros(len(record))})
    with pytest.raises(IdentificationError, match="velocity"):
        fit_output_error(_rig(), [still], free=FREE, channels=CHANNELS)
    assert fit_output_error(_rig(), [still], free=FREE[:1]).channels == ("displacement",)
