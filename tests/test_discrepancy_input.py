"""What goes into a diagnosis: the user's own MJCF, records that start in motion, slides that nothing holds."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from bench.discrepancy import (
    Case,
    CaseChannel,
    NominalParameter,
    diagnose,
    read_case,
    record_from_arrays,
)
from bench.discrepancy.effects.catalogue import effect_named
from bench.discrepancy.fitting.initial_state_fit import predict, run_kind, start_warnings
from bench.discrepancy.fitting.map_fit import fit
from bench.discrepancy.likelihood.problem import Problem
from bench.discrepancy.model.placement import Placed
from bench.discrepancy.model.rigs import structure_of
from bench.discrepancy.prediction.validation_discrepancy import nrmse
from bench.discrepancy.screening.screen import Screen
from bench.discrepancy.settings import DEFAULT, with_values
from bench.discrepancy.simulation.stick_slip import NO_ELEMENTS, Elements, StructureMatrices, free_run
from bench.errors import FileFormatError, ModelError, UnknownNameError
from bench.laws import LAWS
from bench.rig import Element, Rig, simulate
from bench.signals import Excitation, Harmonic

STEP = 2e-3
K3 = 3e6
"""Cubic stiffness [N/m^3]: a third of the linear one at the 10 mm that the records reach."""
CARRIAGE = """<mujoco model="carriage">
  <option gravity="0 0 0" timestep="0.002" integrator="RK4">{flag}</option>
  <worldbody>
    {more}
    <body name="carriage">
      <joint name="x" type="slide" axis="1 0 0" stiffness="900" damping="4" frictionloss="{friction}" {joint}/>
      <geom name="block" type="box" size=".05 .05 .05" mass="1.5"/>
      <site name="cell"/>
    </body>
  </worldbody>
  <actuator><motor name="shaker" joint="x" {actuator}/></actuator>
  <sensor><jointpos name="lvdt" joint="x"/><accelerometer name="icp" site="cell"/></sensor>
</mujoco>"""
CHANNELS = {
    "shaker": {"unit": "N", "role": "measured", "noise_std": 0.01},
    "lvdt": {"unit": "m", "noise_std": 2e-5},
    "icp": {"unit": "m/s^2", "noise_std": 0.02},
}
PARAMETERS = {
    "mass:carriage": {"value": 1.5, "std": 0.03, "unit": "kg"},
    "stiffness:x": {"value": 900.0, "std": 20.0, "unit": "N/m"},
    "damping:x": {"value": 4.0, "std": 1.0, "unit": "N s/m"},
}


STICKS = {"flag": '<flag refsafe="disable"/>', "joint": 'solreffriction="1e-4 1" solimpfriction="0.99 0.999"'}
"""Makes MuJoCo's friction settle within a fortieth of a sample, that is stick."""


def model(
    *, friction: float = 0.0, flag: str = "", more: str = "", joint: str = "", actuator: str = ""
) -> str:
    return CARRIAGE.format(friction=friction, flag=flag, more=more, joint=joint, actuator=actuator)


def loads(n: int, rng: np.random.Generator) -> np.ndarray:
    spectrum = np.zeros(n // 2 + 1, dtype=complex)
    band = np.fft.rfftfreq(n, STEP) < 12.0
    spectrum[band] = rng.standard_normal(band.sum()) + 1j * rng.standard_normal(band.sum())
    force = np.fft.irfft(spectrum, n)
    return 8.0 * force / np.std(force)


def elements(effect: str, theta: list[float]) -> Elements:
    """One effect of the catalogue on the only coordinate."""
    kernels = effect_named(effect).addresses
    return Elements(
        np.array([[*kernels, 1, 0, 0, 0, 0]]), np.ones((1, 1)), np.array([*theta, 0.0]), np.zeros(0)
    )


def write(folder, text, *, parameters=None, channels=None, hidden=NO_ELEMENTS, n=1500):
    """Write a case folder; the records are of 1.51 kg, 905 N/m and 4.2 N s/m with a hidden force."""
    (folder / "model.xml").write_text(text)
    nominal = {
        "rig": "model.xml",
        "parameters": parameters or PARAMETERS,
        "channels": channels or CHANNELS,
    }
    (folder / "nominal.json").write_text(json.dumps(nominal))
    rng = np.random.default_rng(7)
    time = STEP * np.arange(n)
    true = StructureMatrices(*(np.full((1, 1), value) for value in (1.51, 4.2, 905.0, 1.0)))
    for name in ("identification", "validation"):
        force = loads(n, rng)
        motion = free_run(true, hidden, loads=force[:, None], step=STEP)
        columns = (force, motion.position[:, 0], motion.acceleration[:, 0])
        noisy = [x + rng.normal(0.0, std, n) for x, std in zip(columns, (0.01, 2e-5, 0.02), strict=True)]
        table = np.column_stack([time, *noisy])
        np.savetxt(folder / f"{name}.csv", table, delimiter=",", header="time,shaker,lvdt,icp", comments="")
    return folder


def as_sdof(case: Case) -> Case:
    names = {"shaker": "force", "lvdt": "displacement", "icp": "acceleration"}
    plain = {"mass:carriage": "mass", "stiffness:x": "stiffness", "damping:x": "damping"}

    def record(r):
        return record_from_arrays(r.name, r.time, {names[k]: v for k, v in r.values.items()})

    return Case(
        case.name, "sdof", tuple(replace(p, name=plain[p.name]) for p in case.parameters),
        tuple(replace(c, name=names[c.name]) for c in case.channels),
        tuple(record(r) for r in case.identification), tuple(record(r) for r in case.validation),
    )  # fmt: skip


def test_a_model_of_ones_own_has_the_matrices_and_channels_of_the_same_sdof_rig(tmp_path):
    case = read_case(write(tmp_path, model()))
    own, plain = structure_of(case), structure_of(as_sdof(case))
    values = np.array([1.6, 870.0, 3.0])
    a, b = own.at(values), plain.at(values[[0, 2, 1]])
    for mine, theirs in zip(a, b, strict=True):
        np.testing.assert_allclose(
            mine, theirs, rtol=1e-9
        )  # LinearRig probes by unit differences of a few newtons
    assert [(o.channel, o.order) for o in own.observers] == [("lvdt", 0), ("icp", 2)]
    assert own.dofs == ("x",)
    place = own.places[0]
    assert (place.mass, place.stiffness, place.damping) == (("mass:carriage",), "stiffness:x", "damping:x")
    assert (place.name, place.position_unit, place.force_unit) == ("", "m", "N")


@pytest.mark.slow
def test_a_model_of_ones_own_gets_the_verdict_of_the_same_sdof_rig(tmp_path):
    case = read_case(write(tmp_path, model(), hidden=elements("cubic_stiffness", [K3]), n=3000))
    own, plain = diagnose(case, most=1).verdict, diagnose(as_sdof(case), most=1).verdict
    assert [e.name for e in own.named] == [e.name for e in plain.named] == ["cubic_stiffness"]
    assert own.gap.after == pytest.approx(
        plain.gap.after, rel=1e-3
    )  # the fits stop when nothing but 0.05 of chi-squared is left
    for name, estimate in own.named[0].parameters.items():
        other = plain.named[0].parameters[name]
        assert abs(estimate.value - other.value) < 0.1 * other.std


def test_a_load_counts_by_the_gear_that_it_acts_through(tmp_path):
    def force(actuator):
        case = read_case(write(tmp_path, model(actuator=actuator)))
        problem = Problem(case, structure_of(case), case.identification)
        return problem.scales_of(Placed(effect_named("coulomb_friction"), problem.structure.places[0])).force

    assert force('gear="5"') == pytest.approx(5.0 * force(""))


def test_the_simulator_of_the_fits_equals_mujoco_on_a_model_of_ones_own(tmp_path):
    case = read_case(write(tmp_path, model(flag='<flag contact="disable"/>')))
    problem = Problem(case, structure_of(case), case.identification)
    placed = Placed(effect_named("cubic_stiffness"), problem.structure.places[0])
    eta = np.array([0.8])
    theta = placed.effect.kernel_theta(eta, problem.scales_of(placed))
    element = Element(law=LAWS["cubic_stiffness"], joints=("x",), theta=theta)
    tone = Harmonic(frequency=3.0, amplitude=9.0)
    excitation = Excitation({"shaker": tone}, duration=2.0, sample_rate=5000.0)
    made = simulate(Rig.from_file(tmp_path / "model.xml", element, timestep=2e-4), excitation)
    record = record_from_arrays(
        "identification",
        made.time,
        {"shaker": made["shaker"], "lvdt": made["lvdt"], "icp": made["icp_x"]},
    )
    held = replace(
        case,
        identification=(record,),
        validation=(record,),
        options={"load_interpolation": "zero_order_hold"},
    )
    own = Problem(held, problem.structure, held.identification)
    vector = np.append(np.zeros(3), eta)
    vector[3] = placed.effect.parameters[0].eta(theta[0], own.scales_of(placed))
    out = own.simulate((placed,), vector, record)
    # both are fourth-order steps of 0.2 ms on a system of 25 rad/s: (0.005)^4 a step, over 10 000 steps
    assert nrmse(made["lvdt"], out[:, 0]) < 1e-6


def test_a_model_may_have_dry_friction_ranges_and_drawings_that_never_touch(tmp_path):
    text = model(
        friction=1.5, flag=STICKS["flag"], joint=STICKS["joint"] + ' limited="true" range="-1 1"',
        actuator='ctrllimited="true" ctrlrange="-100 100"',
        more='<geom name="wall" type="box" pos="3 0 0" size=".1 .1 .1"/>',
    )  # fmt: skip
    parameters = {**PARAMETERS, "frictionloss:x": {"value": 1.5, "std": 0.2, "unit": "N"}}
    case = read_case(write(tmp_path, text, parameters=parameters, hidden=elements("coulomb_friction", [1.7])))
    problem = Problem(case, structure_of(case), case.identification)
    fitted = fit(problem, (), start=np.zeros(4))
    without = Problem(case, replace(problem.structure, frictions=()), case.identification)
    assert fitted.reduced == pytest.approx(
        1.0, abs=0.1
    )  # 1500 samples, two channels: chi-squared is known to 3 %
    assert fit(without, (), start=np.zeros(4)).reduced > 10.0
    estimate = 1.5 + 0.2 * fitted.vector[3]
    assert abs(estimate - 1.7) < 5 * 0.2 * np.sqrt(fitted.covariance[3, 3])


@pytest.mark.parametrize(
    ("text", "parameters", "channels", "error", "message"),
    [
        (model(), {"mass:cart": PARAMETERS["mass:carriage"]}, None, UnknownNameError, "carriage"),
        (model(), {"mass": PARAMETERS["mass:carriage"]}, None, UnknownNameError, "mass:NAME"),
        (model(), None, {**CHANNELS, "laser": {"unit": "m"}}, UnknownNameError, "lvdt"),
        (model(), None, {"lvdt": CHANNELS["lvdt"]}, FileFormatError, "shaker"),
        (model(), None, {"shaker": CHANNELS["shaker"]}, FileFormatError, "lvdt"),
        (model(), None, {**CHANNELS, "lvdt": {"unit": "m", "joint": "x", "quantity": "place"}}, UnknownNameError, "position"),
        (model(joint='limited="true" range="-1e-4 1e-4"'), None, None, ModelError, "stops of the model"),
        (model(actuator='ctrllimited="true" ctrlrange="-1 1"'), None, None, ModelError, "ctrlrange"),
        (
            model(more='<geom name="wall" type="box" pos=".1 0 0" size=".051 .1 .1"/>'), None, None, ModelError,
            "'wall' and 'block'|'block' and 'wall'",
        ),
        (model().replace('type="slide"', 'type="ball"').replace("<jointpos", "<ballquat"), None, None, ModelError, "slides and hinges"),
        (
            model().replace('gravity="0 0 0"', 'gravity="0 0 -9.81"').replace(
                'type="slide" axis="1 0 0"', 'type="hinge" axis="0 1 0" pos="0 0 .2"'
            ),
            None, None, ModelError, "linear",
        ),
    ],
)  # fmt: skip
def test_models_and_references_that_do_not_fit_are_refused_with_what_to_do(
    tmp_path, text, parameters, channels, error, message
):
    folder = write(tmp_path, text, parameters=parameters, channels=channels)
    if channels and "laser" in channels:
        for name in ("identification", "validation"):
            file = folder / f"{name}.csv"
            file.write_text(file.read_text().replace("icp", "laser", 1))
        channels = {k: v for k, v in channels.items() if k != "icp"}
        nominal = json.loads((folder / "nominal.json").read_text())
        (folder / "nominal.json").write_text(json.dumps({**nominal, "channels": channels}))
    with pytest.raises(error, match=message):
        structure_of(read_case(folder))


def test_channels_may_name_joints_and_actuators(tmp_path):
    channels = {
        "drive": {"unit": "N", "role": "command", "actuator": "shaker", "noise_std": 0.01},
        "encoder": {"unit": "m", "joint": "x", "quantity": "position", "noise_std": 2e-5},
        "tacho": {"unit": "m/s", "joint": "x", "quantity": "velocity", "noise_std": 1e-3},
    }
    folder = write(tmp_path, model(), channels=channels)
    for name in ("identification", "validation"):
        file = folder / f"{name}.csv"
        file.write_text(file.read_text().replace("shaker,lvdt,icp", "drive,encoder,tacho", 1))
    structure = structure_of(read_case(folder))
    assert structure.loads == ("drive",)
    assert [(o.channel, o.order, o.row.tolist()) for o in structure.observers] == [
        ("encoder", 0, [1.0]),
        ("tacho", 1, [1.0]),
    ]


def cut_from_rest(case: Case, first: int) -> Case:
    """The same records without their first samples: they start in motion."""

    def late(record):
        return record_from_arrays(
            record.name, record.time[first:], {k: v[first:] for k, v in record.values.items()}, at_rest=False
        )

    return replace(
        case,
        identification=tuple(map(late, case.identification)),
        validation=tuple(map(late, case.validation)),
    )


@pytest.mark.parametrize("channels", [("lvdt", "icp"), ("icp",)])
def test_records_in_motion_recover_what_records_from_rest_do(tmp_path, channels):
    whole = read_case(write(tmp_path, model(), hidden=elements("cubic_stiffness", [K3]), n=2500))
    whole = replace(whole, channels=tuple(c for c in whole.channels if c.name in {"shaker", *channels}))
    case = cut_from_rest(whole, 700)
    problem = Problem(case, structure_of(case), case.identification)
    placed = Placed(effect_named("cubic_stiffness"), problem.structure.places[0])
    assert len(problem.nominal) == 3 + 2
    point = Screen(problem, [placed]).ranked()[0]  # where a diagnosis starts its fits
    fitted = fit(problem, (placed,), start=np.append(np.zeros(5), point.eta), iterations=30)
    assert fitted.reduced == pytest.approx(1.0, abs=0.15)  # 1800 samples of one or two channels
    _, (eta,) = problem.split(fitted.hypothesis, fitted.vector)
    k3 = placed.effect.values(eta, problem.scales_of(placed))[0]
    std = np.sqrt(fitted.covariance[5, 5]) * placed.effect.parameters[0].slope(
        eta[0], problem.scales_of(placed)
    )
    assert abs(k3 - K3) < 5 * std + 0.01 * K3  # a percent for the load between its samples
    record = case.validation[0]
    assert run_kind(problem, case.validation) == "free run from the estimated initial state"
    assert "in motion" in start_warnings(problem, case.validation)[0]
    channel = channels[0]
    floor = (case.channel(channel).noise_std or 0.0) / np.std(record.values[channel])
    assert (
        nrmse(record.values[channel], predict(problem, fitted.hypothesis, fitted.vector, record)[:, 0])
        < 1.5 * floor
    )
    from_rest = problem.simulate(fitted.hypothesis, fitted.vector, replace(record, at_rest=True))
    assert nrmse(record.values[channel], from_rest[:, 0]) > 3 * floor


def slide(n: int, seed: int, friction: float, push: float = 0.0) -> dict[str, np.ndarray]:
    """Free slide of 2 kg with 5 N s/m and Coulomb friction under a random force, by fine symplectic steps that can stick.

    A slow unmeasured `push` [N] may come on top.
    """
    rng = np.random.default_rng(seed)
    t = STEP * np.arange(n)
    force = 9.0 * np.sign(np.sin(2 * np.pi * 0.8 * t)) * (0.8 + 0.4 * np.sin(2 * np.pi * 0.13 * t + seed))
    force = np.convolve(force, np.hanning(25) / np.hanning(25).sum(), mode="same")
    sub, q, v = 20, 0.0, 0.0
    h = STEP / sub
    position = np.zeros(n)
    for k in range(n):
        position[k] = q
        for s in range(sub):
            u = force[k] + (force[min(k + 1, n - 1)] - force[k]) * (s + 0.5) / sub
            free = v + h * (u + push * np.sin(0.5 * t[k]) - 5.0 * v) / 2.0
            v = np.sign(free) * max(abs(free) - h * friction / 2.0, 0.0)
            q += h * v
    return {"force": force + rng.normal(0, 0.02, n), "displacement": position + rng.normal(0, 1e-5, n)}


def free_slide(friction: float, push: float = 0.0) -> Case:
    n = 3000
    records = [
        record_from_arrays(name, STEP * np.arange(n), slide(n, seed, friction, push))
        for name, seed in (("identification", 1), ("validation", 2))
    ]
    return Case(
        "slide", "sdof", (NominalParameter("mass", 2.03, 0.04, "kg"), NominalParameter("damping", 4.6, 0.8, "N s/m")),
        (CaseChannel("force", "N", "measured", 0.02), CaseChannel("displacement", "m", "response", 1e-5)),
        (records[0],), (records[1],),
    )  # fmt: skip


def test_differences_of_a_record_in_windows_hardly_change_where_what_starts_reach_is_held():
    problem = Problem(case := free_slide(friction=3.0), structure_of(case), case.identification)
    hypothesis = (Placed(effect_named("coulomb_friction"), problem.structure.places[0]),)
    vector = fit(problem, hypothesis, start=np.array([0.0, 0.0, -1.0]), iterations=20).vector
    here, near = problem.residual(hypothesis, vector), problem.residual_near(hypothesis, vector)
    np.testing.assert_array_equal(near(vector), here)
    for step in 0.01 * np.eye(len(vector)):
        whole, held = problem.residual(hypothesis, vector + step) - here, near(vector + step) - here
        # what is left out is of the order of the starts' noise over the motion
        assert np.linalg.norm(held - whole) < 0.1 * np.linalg.norm(whole)


def test_a_free_slide_is_judged_on_windows_and_its_friction_found_again():
    case = free_slide(friction=3.0)
    problem = Problem(case, structure_of(case), case.identification)
    assert problem.windowed
    assert "restarted from the estimated state" in run_kind(problem, case.validation)
    placed = Placed(effect_named("coulomb_friction"), problem.structure.places[0])
    nothing = fit(problem, (), start=np.zeros(2))
    fitted = fit(problem, (placed,), start=np.array([0.0, 0.0, -1.0]), iterations=20)
    assert nothing.reduced > 100.0
    assert (
        fitted.reduced < 1.3
    )  # stick and slip begin within a sample, which the load's interpolation does not know
    values, (eta,) = problem.split(fitted.hypothesis, fitted.vector)
    # an integrator of steps of 0.1 ms made the record: its friction is late by half of that
    assert values == pytest.approx([2.0, 5.0], rel=0.01)
    assert placed.effect.values(eta, problem.scales_of(placed))[0] == pytest.approx(3.0, rel=0.01)


@pytest.mark.slow
def test_what_a_model_leaves_counts_as_a_force_where_no_noise_is_stated():
    case = free_slide(friction=3.0, push=1.5)
    case = replace(case, channels=tuple(replace(c, noise_std=None) for c in case.channels))
    worst = []
    for weight in (DEFAULT.likelihood.white_force, 0.0):
        settings = with_values(DEFAULT, {"likelihood": {"white_force": weight}})
        problem = Problem(case, structure_of(case), case.identification, settings=settings)
        placed = Placed(effect_named("coulomb_friction"), problem.structure.places[0])
        fitted = fit(problem, (placed,), start=np.array([0.0, 0.0, -1.0]), iterations=30)
        values, (eta,) = problem.split(fitted.hypothesis, fitted.vector)
        friction = placed.effect.values(eta, problem.scales_of(placed))[0]
        worst.append(max(abs(values[0] / 2.0 - 1.0), abs(friction / 3.0 - 1.0)))
    # a slow push of half the friction, which no law explains: what reverses with the motion is found beside it
    assert worst[0] < 0.1
    assert worst[0] < 0.3 * worst[1]


def test_whitened_residuals_of_windows_are_white_for_the_right_model():
    case = free_slide(friction=0.0)
    true = (NominalParameter("mass", 2.0, 0.01), NominalParameter("damping", 5.0, 0.01))
    problem = Problem(replace(case, parameters=true), structure_of(case), case.identification)
    residual = problem.residual((), np.zeros(2))
    # of n unit normal numbers the mean square has a standard deviation of sqrt(2 / n)
    assert residual @ residual / problem.n_residuals == pytest.approx(
        1.0, abs=4 * np.sqrt(2 / problem.n_residuals)
    )


@pytest.mark.slow
def test_the_diagnosis_of_a_free_slide_names_its_friction_and_says_how_it_was_judged():
    verdict = diagnose(free_slide(friction=3.0), most=1).verdict
    assert [e.name for e in verdict.named] == ["coulomb_friction"]
    assert "windows of" in verdict.gap.metric
    assert any("drifts" in warning for warning in verdict.warnings)
    assert verdict.gap.after < 2.0 * verdict.gap.noise_floor < 0.2 * verdict.gap.before
