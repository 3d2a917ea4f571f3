"""Excitation design: ensembles against MuJoCo, information against theory and against identifications, limits, methods."""

from __future__ import annotations

import math
import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import cont2discrete

from bench import Element, joint_rig, sdof_rig, simulate
from bench.errors import ModelError, ParameterError, UnknownNameError
from bench.excitation import (
    METHODS,
    Contrast,
    Ensemble,
    Experiment,
    Limits,
    RigHypothesis,
    RigPrior,
    Rivals,
    Uncertain,
    contrast_of,
    controls_from,
    design,
    directions,
    expected_log_bayes_factor,
    feasible,
    fisher_information,
    log_det,
    misfit,
    sensitivity,
)
from bench.excitation.bayes_factor import accumulate_contrast
from bench.excitation.experiment import fan
from bench.excitation.information import (
    INFORMATION_LIMITS,
    accumulate,
)
from bench.excitation.methods import spectral_lines
from bench.excitation.prior import with_values
from bench.excitation.rivals import imitate
from bench.rig import Rig
from bench.rig.library import six_dof_rig
from bench.signals import Excitation

STRUCTURE = (Uncertain("stiffness:carriage", 200.0, 400.0), Uncertain("damping:carriage", 0.8, 3.0))
NOISE = {"displacement": 5e-4, "acceleration_x": 0.2}
LIMITS = Limits({"shaker": 2.0}, {"shaker": 4.0}, {"displacement": 0.02}, {"velocity": 0.3})
BAND = (0.5, 5.0)


def sdof(*elements: Element) -> Rig:
    return sdof_rig(*elements, mass=2.0, stiffness=300.0, damping=1.5, timestep=1e-2)


def hypothesis(law: str, **ranges: tuple[float, float]) -> RigHypothesis:
    own = tuple(Uncertain(f"{law}.{name}", *bounds) for name, bounds in ranges.items())
    return RigHypothesis(law, sdof(Element.of(law, "carriage", name=law)), (*STRUCTURE, *own))


GAP = hypothesis("gap", stiffness=(300.0, 1500.0), clearance=(2e-3, 1e-2))
BOUC_WEN = hypothesis("bouc_wen", A=(30.0, 200.0), beta=(80.0, 300.0), gamma=(20.0, 120.0))
CUBIC = hypothesis("cubic_stiffness", k3=(5e4, 2e6))
PRIOR = RigPrior((GAP, BOUC_WEN))


def experiment(question: RigPrior | Rivals = PRIOR, draws: int = 4, threads: int = 1) -> Experiment:
    rng = np.random.default_rng(3)
    if isinstance(question, Rivals):
        u = 0.5 * np.sin(2.0 * np.pi * np.linspace(0.0, 1.0, 200) * np.linspace(1.0, 4.0, 200))[:, None]
        drawn = question.draws(
            draws, rng, reference=u, channels=tuple(NOISE), actuators=("shaker",), noise=np.array([5e-4, 0.2])
        )
        return Experiment(question, NOISE, LIMITS, drawn, threads)
    return Experiment(question, NOISE, LIMITS, question.draws(draws, rng), threads)


def wave(n: int = 400, seed: int = 0, scale: float = 1.0) -> np.ndarray:
    """A smooth command ``(n, 1)`` with its power about the resonance at 2 Hz."""
    rng = np.random.default_rng(seed)
    t = np.arange(n) * 1e-2
    lines = np.arange(1, 13) * 0.3
    return (
        scale
        * np.sum(
            np.sin(2.0 * np.pi * lines * t[:, None] + rng.uniform(0.0, 2.0 * np.pi, 12)),
            axis=1,
            keepdims=True,
        )
        / np.sqrt(12.0)
    )


@pytest.mark.parametrize(
    ("rig", "channels", "force"),
    [
        (
            sdof(Element.of("gap", "carriage", clearance=2e-3), Element.of("bouc_wen", "carriage", A=100.0)),
            ("displacement", "velocity", "acceleration_x", "load_cell"),
            (2.0, 0.0),
        ),
        (
            sdof(Element.of("lugre", "carriage", limit=0.5, bristle_stiffness=500.0)),
            ("displacement",),
            (2.0, 0.0),
        ),
        (
            sdof(
                Element.of(
                    "controlled_friction", "carriage", inputs=("normal_force",), regularisation_velocity=0.02
                )
            ),
            ("displacement", "normal_force_cell"),
            (2.0, 3.0),
        ),
        (
            joint_rig(timestep=2e-3),
            ("axial", "torsional", "displacement_1", "rotation_2", "axial_velocity", "acceleration_2_x"),
            (4000.0, 100.0),
        ),
    ],
    ids=["gap and bouc_wen", "lugre", "law with an input", "deck joint"],
)
def test_ensembles_are_mujoco_to_rounding(
    rig: Rig, channels: tuple[str, ...], force: tuple[float, float]
) -> None:
    u = np.concatenate([wave(800, 1, force[0]), 0.5 * force[1] + 0.3 * wave(800, 2, force[1])], axis=1)
    record = simulate(rig, dict(zip(rig.actuators, u.T, strict=True)))
    ours = Ensemble((rig,), channels).record(u[None])[0, 0]
    for column, name in zip(ours.T, channels, strict=True):
        # The same arithmetic in another order over 800 steps; kinks do not amplify it at these levels.
        np.testing.assert_allclose(column, record[name], atol=1e-9 * np.max(np.abs(record[name])))


def test_records_do_not_depend_on_threads_blocks_or_company() -> None:
    rigs = tuple(draw.rig for draw in PRIOR.draws(4, np.random.default_rng(0)))
    drives = np.stack([wave(120, seed) for seed in range(9)])
    alone = Ensemble(rigs, tuple(NOISE), ("shaker",))
    whole = alone.record(drives)
    np.testing.assert_array_equal(Ensemble(rigs, tuple(NOISE), ("shaker",), 3).record(drives), whole)
    np.testing.assert_array_equal(
        Ensemble(rigs[1:2], tuple(NOISE), ("shaker",)).record(drives)[:, 0], whole[:, 1]
    )
    np.testing.assert_array_equal(pickle.loads(pickle.dumps(alone)).record(drives), whole)
    members, counts = np.tile(np.arange(4), (9, 1)), np.full(9, 4)
    states = alone.start(members)
    parts = [
        alone.integrate(part, states, members=members, counts=counts)
        for part in np.split(drives, [50], axis=1)
    ]
    np.testing.assert_array_equal(np.concatenate(parts, axis=2), whole)


def test_degrees_of_freedom_at_rest_are_left_out() -> None:
    rig = sdof(Element.of("gap", "carriage", name="gap"))
    assert Ensemble((rig,), ("displacement",)).n_states == 4  # carriage and clamp
    assert Ensemble((rig,), ("displacement",), ("shaker",)).n_states == 2


@pytest.mark.parametrize(
    ("rig", "channel"),
    [
        (sdof(Element.of("coulomb", "carriage", exact=True)), "displacement"),
        (sdof().with_(integrator="Euler"), "displacement"),
        (six_dof_rig(), None),
    ],
    ids=["exact friction", "integrator", "rotations"],
)
def test_what_is_not_linear_around_its_elements_is_refused(rig: Rig, channel: str | None) -> None:
    name = channel or next(c.name for c in rig.channels if c.role == "measured" and "acceleration" in c.name)
    with pytest.raises(ModelError, match="only MuJoCo simulates it"):
        Ensemble((rig,), (name,))


def test_ensembles_name_what_they_do_not_know() -> None:
    with pytest.raises(UnknownNameError, match="measured channel"):
        Ensemble((sdof(),), ("nothing",))
    with pytest.raises(UnknownNameError, match="actuator"):
        Ensemble((sdof(),), ("displacement",), ("nothing",))
    with pytest.raises(ModelError, match="differ in their MJCF"):
        Ensemble((sdof(), joint_rig()), ("displacement",))


def test_sensitivity_of_a_linear_rig_is_that_of_its_variational_equation() -> None:
    draw = RigHypothesis("linear", sdof(), STRUCTURE).of(
        {"stiffness:carriage": 280.0, "damping:carriage": 2.0}
    )
    u = wave(500)
    found = sensitivity(draw, {"shaker": u[:, 0]}, channels=("displacement",), central=True)
    # d/dk of m x'' + c x' + k x = F is the same oscillator driven by -x, and by -x' for c; solved exactly for held forces.
    m, c, k = 2.0, 2.0, 280.0
    a = np.zeros((6, 6))
    for i in range(3):
        a[2 * i, 2 * i + 1], a[2 * i + 1, 2 * i], a[2 * i + 1, 2 * i + 1] = 1.0, -k / m, -c / m
    a[3, 0], a[5, 1] = -1.0 / m, -1.0 / m
    b = np.zeros((6, 1))
    b[1] = 1.0 / m
    ad, bd, *_ = cont2discrete((a, b, np.eye(6), np.zeros((6, 1))), 1e-2)
    x = np.zeros((500, 6))
    for i in range(499):
        x[i + 1] = ad @ x[i] + bd[:, 0] * u[i, 0]
    scale = [k * math.log(2.0) / math.sqrt(12.0), c * math.log(3.0 / 0.8) / math.sqrt(12.0)]
    for i in range(2):
        exact = x[:, 2 + 2 * i] * scale[i]
        # RK4 with 50 steps a period: (omega h)^4 / 120 = 2e-6 a radian, over 60 radians, twice that in the derivative.
        np.testing.assert_allclose(found.jacobian[:, 0, i], exact, atol=5e-4 * np.max(np.abs(exact)))


@pytest.mark.parametrize("kind", [GAP, BOUC_WEN], ids=lambda h: h.name)
def test_information_agrees_with_central_differences_in_mujoco(kind: RigHypothesis) -> None:
    draw = kind.at(np.zeros(len(kind.parameters)))
    drive, channels = {"shaker": wave(250)[:, 0]}, tuple(NOISE)
    noise = np.array(list(NOISE.values()))
    ours = fisher_information(sensitivity(draw, drive, channels=channels), noise)
    other = fisher_information(
        sensitivity(draw, drive, channels=channels, engine="mujoco", central=True, step=1e-3, threads=1),
        noise,
    )
    scale = np.sqrt(np.outer(np.diag(other), np.diag(other)))
    # Steps of 1e-4 and 1e-3 prior standard deviations: curvature, and for the gap the samples near its kinks.
    np.testing.assert_allclose(ours / scale, other / scale, atol=0.02)


@pytest.mark.slow
def test_scatter_of_200_identifications_is_the_inverse_information() -> None:
    names = ("gap.stiffness", "gap.clearance")
    kind = RigHypothesis("gap", GAP.rig, tuple(p for p in GAP.parameters if p.name in names))
    truth, u, channels = kind.at([0.3, -0.4]), wave(300), tuple(NOISE)
    noise = np.array(list(NOISE.values()))
    at_truth = sensitivity(truth, {"shaker": u[:, 0]}, channels=channels)
    information = fisher_information(at_truth, noise)
    rows = (at_truth.jacobian / noise[:, None]).reshape(-1, 2)
    rng = np.random.default_rng(7)
    records = at_truth.output + noise * rng.standard_normal((200, *at_truth.output.shape))
    # Each record is fitted by least squares; steps with the Jacobian at the truth, which the solution does not depend on.
    x = np.tile(truth.coordinates, (200, 1))
    for _ in range(6):
        ensemble = Ensemble(tuple(kind.at(row).rig for row in x), channels, ("shaker",))
        residual = ((records - ensemble.record(u[None])[0]) / noise).reshape(200, -1)
        step = residual @ rows @ np.linalg.inv(information)
        x += step
    assert np.max(np.abs(step)) < 1e-4  # converged, against standard deviations of some 1e-2
    scatter = np.std(x - truth.coordinates, axis=0, ddof=1)
    bound = np.sqrt(np.diag(np.linalg.inv(information)))
    # The standard deviation of 200 draws is itself known within 5 % (one sigma).
    np.testing.assert_allclose(scatter, bound, rtol=0.15)
    assert abs(np.mean((x - truth.coordinates) / bound)) < 4.0 / np.sqrt(200.0)


def test_what_the_record_cannot_see_adds_nothing() -> None:
    draw = GAP.of(
        {"stiffness:carriage": 300.0, "damping:carriage": 1.5, "gap.stiffness": 800.0, "gap.clearance": 9e-3}
    )
    small = {
        "shaker": wave(300, scale=0.05)[:, 0]
    }  # moves the carriage by some millimetres: the gap stays open
    record = sensitivity(draw, small, channels=("displacement",))
    assert np.max(np.abs(record.output)) < 9e-3
    information = fisher_information(record, np.array([5e-4]))
    split = directions(information)
    assert split.identifiable.sum() == 2
    np.testing.assert_array_equal(information[2:], 0.0)
    # The two directions that it does see, alone.
    assert log_det(information) == pytest.approx(log_det(information[:2, :2]), rel=1e-12)


@given(seed=st.integers(0, 10_000), n=st.integers(1, 4))
@settings(max_examples=10, deadline=None)
def test_information_grows_and_windows_add_up(seed: int, n: int) -> None:
    draw = PRIOR.draw(np.random.default_rng(seed))
    rigs, _, counts = fan((draw,), INFORMATION_LIMITS.step)
    outputs = Ensemble(rigs, tuple(NOISE), ("shaker",)).record(wave(60, seed)[None])
    noise = np.array(list(NOISE.values()))
    p = int(counts[0])
    measured = outputs[:, 0] + 1e-3
    sums = [np.zeros((1, 1, p, p)), np.zeros((1, 1, p)), np.zeros((1, 1)), np.zeros((1, 1))]
    last = 0.0
    for part in np.array_split(np.arange(60), n):
        accumulate(
            0,
            1,
            outputs[:, :, part],
            counts[None],
            INFORMATION_LIMITS.step,
            1.0 / noise,
            measured[:, part],
            *sums,
        )
        assert sums[3][0, 0] >= last - 1e-9  # information is never lost; rounding of sums of up to 1e9
        last = sums[3][0, 0]
    rows = ((outputs[0, 1:] - outputs[0, 0]) / INFORMATION_LIMITS.step / noise).reshape(p, -1)
    residual = ((measured[0] - outputs[0, 0]) / noise).ravel()
    np.testing.assert_allclose(
        sums[0][0, 0], rows @ rows.T, rtol=1e-9, atol=1e-9 * np.abs(rows @ rows.T).max()
    )
    assert sums[3][0, 0] == pytest.approx(float(log_det(rows @ rows.T)), rel=1e-9)
    dense = np.eye(residual.size) + rows.T @ rows
    # misfit is the exponent of N(r; 0, I + J J'); the inverse of that matrix loses some digits to its condition.
    assert misfit(*sums[:3])[0, 0] == pytest.approx(residual @ np.linalg.solve(dense, residual), rel=1e-5)


def _dense_divergence(mean: np.ndarray, true: np.ndarray, rival: np.ndarray) -> float:
    inverse = np.linalg.inv(rival)
    trace = np.trace(inverse @ true) - len(mean)
    return 0.5 * float(
        mean @ inverse @ mean + trace - np.linalg.slogdet(true)[1] + np.linalg.slogdet(rival)[1]
    )


def test_expected_log_bayes_factor_is_the_divergence_of_the_marginal_likelihoods() -> None:
    first, second = GAP.at([0.1, 0.2, 0.0, -0.5]), CUBIC.at([0.0, 0.1, 0.3])
    drive, noise = {"shaker": wave(80)[:, 0]}, np.array([5e-4, 0.2])
    a, b = (sensitivity(d, drive, channels=tuple(NOISE)) for d in (first, second))
    value = float(expected_log_bayes_factor(contrast_of(a, b, noise)))
    rows = [(s.jacobian / noise[:, None]).reshape(160, -1) for s in (a, b)]
    marginals = [np.eye(160) + j @ j.T for j in rows]
    r = ((a.output - b.output) / noise).ravel()
    dense = 0.5 * (_dense_divergence(r, *marginals) + _dense_divergence(r, *marginals[::-1]))
    assert value == pytest.approx(dense, rel=1e-6)  # two ways round matrices of condition 1e5
    assert float(expected_log_bayes_factor(contrast_of(a, a, noise))) == pytest.approx(0.0, abs=1e-8)
    # The same sums, window by window in compiled code.
    rigs, places, counts = fan((first, second), INFORMATION_LIMITS.step)
    outputs = Ensemble(rigs, tuple(NOISE), ("shaker",)).record(wave(80)[None])
    sums = Contrast.zeros(1, 1, parameters=4)
    for part in (slice(0, 30), slice(30, 80)):
        accumulate_contrast(
            0,
            1,
            outputs[:, :, part],
            places[None, None],
            counts[None, None],
            INFORMATION_LIMITS.step,
            1.0 / noise,
            sums,
        )
    assert float(expected_log_bayes_factor(sums)[0, 0]) == pytest.approx(value, rel=1e-9)


def test_a_hypothesis_imitates_its_own_record() -> None:
    truth = GAP.at([0.5, -0.3, 0.2, -0.6])
    u, noise = wave(200), np.array([5e-5, 0.02])
    record = Ensemble((truth.rig,), tuple(NOISE), ("shaker",)).record(u[None])[0, 0]
    found = imitate(GAP, record, reference=u, channels=tuple(NOISE), actuators=("shaker",), noise=noise)
    # The prior pulls by a share of one over the gain, which is 1e3 and more with sensors as good as these.
    np.testing.assert_allclose(found.coordinates, truth.coordinates, atol=5e-3)


def test_limits_hold_and_bind() -> None:
    study = experiment()
    drives = np.stack([wave(300, seed) for seed in range(4)])
    for exact, slack in ((True, 1e-3), (False, 0.75)):
        scaled = feasible(study.watched, LIMITS, drives, exact=exact)
        ratio = study.violation(scaled)
        force = np.max(np.abs(scaled), axis=(1, 2)) / 2.0
        energy = 1e-2 * np.sum(scaled**2, axis=(1, 2)) / 4.0
        largest = np.max([ratio, force, energy], axis=0)
        assert np.all(largest <= 1.0 + 1e-12)
        assert np.all(largest > 1.0 - slack)  # bisected within 0.02 %; the quick scale may stop early
    full = LIMITS.within_actuator(drives, timestep=1e-2)
    down = LIMITS.within_actuator(1e-3 * drives, timestep=1e-2, fill=False)
    assert np.max(np.abs(full)) <= 2.0 * (1.0 + 1e-12)
    np.testing.assert_array_equal(down, 1e-3 * drives)


@pytest.mark.slow
@pytest.mark.parametrize(
    "question", [PRIOR, Rivals("gap_cubic", GAP, CUBIC)], ids=["identify", "discriminate"]
)
def test_methods_keep_the_limits_and_the_designed_one_is_best(question: RigPrior | Rivals) -> None:
    study = experiment(question)
    merits = {}
    for method in METHODS:
        plan = design(method, study, duration=2.0, band=BAND, rng=np.random.default_rng(5), evaluations=480)
        reached = plan.peaks
        values = [v for table in reached for v in table.values()]
        assert max(values) == pytest.approx(1.0, abs=1e-3)  # as large as the limits allow, and no larger
        assert max(values) <= 1.0 + 1e-9
        merits[method] = plan.merit
        controls = controls_from(plan)
        assert controls.shape == (200, 1)
        assert float(study.merit(controls[None])[0]) == pytest.approx(plan.merit, rel=1e-12)
    assert merits["d_optimal"] > max(value for name, value in merits.items() if name != "d_optimal")


def test_designs_are_reproducible_and_travel() -> None:
    study = experiment()
    plans = [
        design("d_optimal", study, duration=1.0, band=BAND, rng=np.random.default_rng(2), evaluations=32)
        for study in (study, experiment(threads=2))
    ]
    np.testing.assert_array_equal(controls_from(plans[0]), controls_from(plans[1]))
    again = Excitation.from_dict(plans[0].excitation.to_dict())
    np.testing.assert_array_equal(again.sample(), controls_from(plans[0]))
    copy = pickle.loads(pickle.dumps(study))
    drive = wave(100)[None]
    np.testing.assert_array_equal(copy.merit(drive), study.merit(drive))


def test_design_says_what_it_cannot_do() -> None:
    study = experiment()
    rng = np.random.default_rng(0)
    with pytest.raises(UnknownNameError, match="d_optimal"):
        design("dopt", study, duration=1.0, band=BAND, rng=rng)
    with pytest.raises(ParameterError, match="half the step rate"):
        design("prbs", study, duration=1.0, band=(1.0, 60.0), rng=rng)
    with pytest.raises(ParameterError, match="no harmonic"):
        spectral_lines((1.1, 1.9), 1.0)


@given(
    low=st.floats(1e-3, 1e3), factor=st.floats(1.01, 100.0), at=st.floats(-1.7, 1.7), log=st.booleans()
)  # fmt: skip
def test_coordinates_are_standardised(low: float, factor: float, at: float, log: bool) -> None:
    item = Uncertain("gap.clearance", low, low * factor, "logarithmic" if log else "linear")
    assert item.low < item.value(at) < item.high
    assert item.coordinate(item.value(at)) == pytest.approx(at, abs=1e-6)  # ranges of 1 % lose some digits
    assert item.coordinate(item.high) == pytest.approx(math.sqrt(3.0))


def test_draws_are_spread_and_weighed() -> None:
    prior = RigPrior((GAP, RigHypothesis("bouc_wen", BOUC_WEN.rig, BOUC_WEN.parameters, weight=3.0)))
    rng = np.random.default_rng(0)
    draws = prior.draws(7, rng)
    assert [d.hypothesis.name for d in draws] == ["gap"] * 4 + ["bouc_wen"] * 3
    clearances = sorted(d.coordinates[3] / math.sqrt(3.0) for d in draws[:4])
    assert all(-1.0 + 0.5 * i <= c <= -0.5 + 0.5 * i for i, c in enumerate(clearances))  # one in each quarter
    weights = prior.draw_weights(draws)
    assert weights[:4].sum() == pytest.approx(0.25)
    names = [prior.draw(rng).hypothesis.name for _ in range(400)]
    assert names.count("gap") / 400 == pytest.approx(0.25, abs=0.09)  # four standard deviations
    draw = draws[0]
    assert draw.rig.element("gap").parameters["clearance"] == draw.values["gap.clearance"]
    assert ("stiffness", "carriage", draw.values["stiffness:carriage"]) in draw.rig.structure
    assert dict(pickle.loads(pickle.dumps(draw)).values) == dict(draw.values)


def test_priors_say_what_is_wrong() -> None:
    with pytest.raises(ParameterError, match="positive range"):
        Uncertain("gap.offset", -1.0, 1.0)
    with pytest.raises(ParameterError, match="ascending"):
        Uncertain("gap.clearance", 2.0, 1.0)
    with pytest.raises(UnknownNameError, match="element"):
        with_values(GAP.rig, {"nothing.clearance": 1.0})
    with pytest.raises(UnknownNameError, match="parameter"):
        RigHypothesis("gap", GAP.rig, (Uncertain("gap.width", 1.0, 2.0),))
    with pytest.raises(ParameterError, match="at least one each"):
        PRIOR.draws(1, np.random.default_rng(0))
    with pytest.raises(ParameterError, match="limit of 'shaker'"):
        Limits({"shaker": -1.0})
    with pytest.raises(ParameterError, match="noise levels"):
        Experiment(PRIOR, {"displacement": 0.0}, LIMITS, PRIOR.draws(2, np.random.default_rng(0)))


def test_unstable_rigs_are_named_instead_of_searched_for_ever() -> None:
    away = RigHypothesis(
        "constant", sdof(Element.of("constant_force", "carriage", F0=100.0, name="constant")), STRUCTURE
    )
    prior = RigPrior((away,))
    study = Experiment(prior, NOISE, LIMITS, prior.draws(1, np.random.default_rng(0)))
    with pytest.raises(ParameterError, match="however small"):
        feasible(study.watched, LIMITS, wave(100)[None])
