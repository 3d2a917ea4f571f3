"""Models whose own forces no matrix holds: gravity on joints that turn, and dry friction, of an MJCF of one's own."""

from __future__ import annotations

import json

import mujoco
import numpy as np
import pytest
from mujoco.rollout import rollout
from test_discrepancy_input import PARAMETERS, STICKS, model, write

from bench.discrepancy import diagnose, read_case
from bench.discrepancy.checks.data_quality import notes
from bench.discrepancy.effects.catalogue import effect_named
from bench.discrepancy.likelihood.problem import Problem
from bench.discrepancy.likelihood.whitening import whitened
from bench.discrepancy.localisation.force_smoother import observers
from bench.discrepancy.model.rigs import structure_of
from bench.discrepancy.simulation.stick_slip import Elements
from bench.errors import ModelError

RATE, FINE = 250.0, 40
"""Samples a second, and steps a sample of the simulations that stand for measurements."""
ARM = """<body name="{body}" pos="{x} 0 {z}">
  <joint name="{joint}" type="hinge" axis="0 1 0" damping="0.01" armature="0.003" {more}/>
  <inertial pos="{at}" mass="0.5" diaginertia="0.0005 0.0005 0.0005"/>{child}</body>"""
LEVER = 0.15
"""Distance of the mass from the joint [m]."""
WEIGHT = 0.5 * 9.81 * LEVER
"""Tangent stiffness of the hanging arm [N m/rad]."""
BELIEVED = {
    "mass:arm": {"value": 0.5, "std": 0.01, "unit": "kg"},
    "damping:hinge": {"value": 0.01, "std": 0.003, "unit": "N m s/rad"},
}
CHANNELS = {
    "motor": {"unit": "N m", "role": "measured", "noise_std": 0.001},
    "angle": {"unit": "rad", "noise_std": 5e-4, "joint": "hinge", "quantity": "position"},
}


def arm(body="arm", joint="hinge", *, x=0.0, z=0.0, at=f"0 0 {-LEVER}", more="", child=""):
    return ARM.format(body=body, joint=joint, x=x, z=z, at=at, more=more, child=child)


def mjcf(*bodies, joint="hinge"):
    return (
        '<mujoco><option gravity="0 0 -9.81" timestep="0.001" integrator="RK4"><flag contact="disable"/></option>'
        f'<worldbody>{"".join(bodies)}</worldbody><actuator><motor name="motor" joint="{joint}"/></actuator></mujoco>'
    )


def swung(text, load, hidden=None):
    """Angle (n,) of the first joint under a load (n,) and a hidden torque, by MuJoCo in fine steps."""
    simulated = mujoco.MjModel.from_xml_string(text)
    simulated.opt.timestep = 1.0 / (RATE * FINE)
    data = mujoco.MjData(simulated)
    # a step holds its load: the mean of the straight line over it
    parts = (np.arange(FINE) + 0.5) / FINE
    held = (load[:, None] + parts * np.append(np.diff(load), 0.0)[:, None]).ravel()
    if hidden is None:
        start = np.zeros(mujoco.mj_stateSize(simulated, mujoco.mjtState.mjSTATE_FULLPHYSICS))
        mujoco.mj_getState(simulated, data, start, mujoco.mjtState.mjSTATE_FULLPHYSICS)
        controls = np.zeros((1, len(held), simulated.nu))
        controls[0, :, 0] = held
        states, _ = rollout(simulated, data, start, controls)
        angles = np.concatenate([start[1:2], states[0, :, 1]])
    else:
        angles = np.zeros(len(held))
        for k, torque_now in enumerate(held):
            angles[k] = data.qpos[0]
            data.ctrl[0] = torque_now
            data.qfrc_applied[0] = hidden(data.qpos[0], data.qvel[0])
            mujoco.mj_step(simulated, data)
    return angles[: len(held) : FINE] - float(simulated.qpos0[0])


def torque(seed, level, n=2000):
    rng = np.random.default_rng(seed)
    frequency = np.fft.rfftfreq(n, 1.0 / RATE)
    spectrum = (rng.standard_normal(len(frequency)) + 1j * rng.standard_normal(len(frequency))) * (
        frequency < 4.0
    )
    load = np.fft.irfft(spectrum, n)
    return level * load / np.std(load)


def record(folder, text, level, hidden=None, *, parameters=None, channels=None, true=None):
    """A case folder of a model, whose records come from the `true` one (itself where None) with a hidden torque."""
    (folder / "model.xml").write_text(text)
    nominal = {"rig": "model.xml", "parameters": parameters or BELIEVED, "channels": channels or CHANNELS}
    (folder / "nominal.json").write_text(json.dumps(nominal))
    rng = np.random.default_rng(5)
    for seed, name in enumerate(("identification", "validation")):
        load = torque(seed, level)
        angle = swung(true or text, load, hidden)
        noisy = load + rng.normal(0.0, 0.001, len(load)), angle + rng.normal(0.0, 5e-4, len(load))
        table = np.column_stack([np.arange(len(load)) / RATE, *noisy])
        np.savetxt(folder / f"{name}.csv", table, delimiter=",", header="time,motor,angle", comments="")
    return read_case(folder)


def free_run(case, load):
    """Free run of the nominal model under a load without noise."""
    problem = Problem(case, structure_of(case), case.identification)
    clean = case.identification[0].__class__(
        "identification", 1.0 / RATE, 0.0, {**case.identification[0].values, "motor": load}
    )
    return problem.simulate((), np.zeros(len(problem.nominal)), clean)[:, 0]


def test_a_pendulum_swings_as_in_mujoco(tmp_path):
    text = mjcf(arm())
    case = record(tmp_path, text, 0.25)
    load = torque(9, 0.25)
    expected = swung(text, load)
    assert np.abs(expected).max() > 1.2  # 70 degrees: a tangent would be off by a tenth there
    # steps of a sample against steps of a fortieth of it: a tenth of the noise
    np.testing.assert_allclose(free_run(case, load), expected, atol=5e-5)


def test_stiffness_and_its_change_with_the_mass_are_those_of_the_weight(tmp_path):
    case = record(tmp_path, mjcf(arm()), 0.1)
    structure = structure_of(case)
    assert structure.at(np.array([0.5, 0.01])).stiffness[0, 0] == pytest.approx(WEIGHT, rel=1e-6)
    assert structure.at(np.array([0.6, 0.01])).stiffness[0, 0] == pytest.approx(1.2 * WEIGHT, rel=1e-6)
    (place,) = structure.places
    assert (place.mass, place.stiffness) == (("mass:arm",), "")  # the weight is no spring of the model
    (spring,) = structure.springs
    angles = np.linspace(-3.0, 3.0, 50)
    for mass in (0.5, 0.6):
        beyond = 2.0 * mass * WEIGHT * (np.sin(angles) - angles)
        found = spring.along(spring.coefficients(np.array([mass, 0.01])), angles[:, None])
        np.testing.assert_allclose(found, beyond, atol=1e-7)


def test_a_lever_whose_weight_a_spring_bears_is_counted_from_where_it_rests(tmp_path):
    borne = f'stiffness="8" springref="{-np.degrees(WEIGHT / 8.0)}"'
    text = mjcf(arm(at=f"{LEVER} 0 0", more=borne))
    case = record(tmp_path, text, 0.5)
    load = torque(9, 0.5)
    np.testing.assert_allclose(free_run(case, load), swung(text, load), atol=5e-5)


@pytest.mark.parametrize(
    ("hidden", "level", "expected"),
    [
        (None, 0.2, ()),
        (lambda q, v: -0.04 * np.tanh(v / 2e-3), 0.25, ("coulomb_friction",)),
        (lambda q, v: -4.0 * np.sign(q) * max(abs(q) - 0.8, 0.0), 0.25, ("gap",)),
        (lambda q, v: -0.01 * v * abs(v), 0.4, ("quadratic_damping",)),
    ],
)  # fmt: skip
def test_what_a_pendulum_lacks_is_named(tmp_path, hidden, level, expected):
    found = diagnose(record(tmp_path, mjcf(arm()), level, hidden))
    assert tuple(e.name for e in found.verdict.named) == expected
    assert found.verdict.verdict == ("effect" if expected else "none")
    # damping of a hundredth of the critical one is known from eight seconds to a few percent, which shows beside the noise
    assert found.verdict.gap.after < 2.0 * found.verdict.gap.noise_floor


def test_pendulums_that_nothing_couples_keep_their_own_gravity(tmp_path):
    text = mjcf(arm(), arm("other", "second", x=1.0, at="0 0 -0.3"))
    channels = {**CHANNELS, "angle": {**CHANNELS["angle"]}}
    case = record(tmp_path, text, 0.1, channels=channels)
    assert structure_of(case).dofs == ("hinge",)
    both = tmp_path / "both"
    both.mkdir()
    two = text.replace("</actuator>", '<motor name="push" joint="second"/></actuator>')
    channels = {
        **channels,
        "push": {"unit": "N m", "role": "measured", "noise_std": 0.001},
        "tilt": {"unit": "rad", "noise_std": 5e-4, "joint": "second", "quantity": "position"},
    }
    record(both, two, 0.1, channels=CHANNELS)
    for name in ("identification", "validation"):
        table = np.loadtxt(both / f"{name}.csv", delimiter=",", skiprows=1)
        table = np.column_stack([table, table[:, 1:] * [1.0, 0.5]])
        np.savetxt(
            both / f"{name}.csv", table, delimiter=",", header="time,motor,angle,push,tilt", comments=""
        )
    nominal = json.loads((both / "nominal.json").read_text())
    (both / "nominal.json").write_text(json.dumps({**nominal, "channels": channels}))
    structure = structure_of(read_case(both))
    assert structure.groups() == [(0,), (1,)]
    values = np.array([0.5, 0.01])
    for i, stiffness in enumerate((WEIGHT, 2.0 * WEIGHT)):
        part = structure.restricted([i])
        (spring,) = part.springs
        own = values[: len(part.parameters)]
        assert part.at(own).stiffness[0, 0] == pytest.approx(stiffness, rel=1e-6)
        assert spring.along(spring.coefficients(own), np.array([[1.0]]))[0] == pytest.approx(
            stiffness * (np.sin(1.0) - 1.0), rel=1e-6
        )


def test_an_arm_on_an_arm_is_refused(tmp_path):
    child = arm("forearm", "elbow", z=-0.3, at="0 0 -0.1")
    with pytest.raises(ModelError, match=r"cannot be the nominal model.*levers that carry one another"):
        structure_of(record(tmp_path, mjcf(arm(child=child)), 0.1))


def test_a_reference_position_that_is_not_that_of_rest_is_refused(tmp_path):
    with pytest.raises(ModelError, match=r"'hinge'.*as they hang at rest"):
        structure_of(record(tmp_path, mjcf(arm(at=f"{LEVER} 0 0")), 0.01))


def test_a_pendulum_over_the_top_is_refused(tmp_path):
    with pytest.raises(ModelError, match=r"'hinge' turns by .*followed up to 6\.283"):
        structure_of(record(tmp_path, mjcf(arm()), 1.5))


def test_a_swing_to_where_gravity_drives_on_is_told(tmp_path):
    case = record(tmp_path, mjcf(arm()), 0.4, lambda q, v: -0.01 * v * abs(v))
    told = notes(case, Problem(case, structure_of(case), case.identification))
    assert any("'hinge' swings to" in note and "beyond 90" in note for note in told)


def test_the_map_of_a_missing_force_leaves_out_the_friction_that_the_model_has(tmp_path):
    friction, gap = (effect_named(name).addresses for name in ("coulomb_friction", "gap"))
    table = np.array([[*friction, 1, 0, 0, 0, 0], [*gap, 1, 0, 1, 0, 0]])
    hidden = Elements(table, np.ones((1, 1)), np.array([1.5, 2000.0, 0.006, 0.0, 0.0]), np.zeros(0))
    parameters = {**PARAMETERS, "frictionloss:x": {"value": 1.5, "std": 0.1, "unit": "N"}}
    text = model(friction=1.5, **STICKS)
    case = read_case(write(tmp_path, text, parameters=parameters, hidden=hidden))
    (observer,) = observers(Problem(case, structure_of(case), case.identification))
    true = {"mass:carriage": 1.51, "stiffness:x": 905.0, "damping:x": 4.2}
    found = observer.estimate(case.identification[0], observer.nominal(true))
    beyond = np.maximum(np.abs(found.position) - 0.006, 0.0) * np.sign(found.position)
    # where it sticks the friction is not known, which is a moment at every reversal and the start, where it stands
    assert np.std((found.force - 2000.0 * beyond)[1:]) < 0.1


def test_noise_of_the_load_is_white_where_a_change_of_stiffness_shows(tmp_path):
    case = record(tmp_path, mjcf(arm()), 0.25)
    problem = Problem(case, structure_of(case), case.identification)
    (data,), model, rng = problem.data, ((), np.zeros(2)), np.random.default_rng(2)
    clean = problem.simulate(*model, data.record)
    changed = problem.simulate((), np.array([0.02, 0.0]), data.record) - clean
    spread = {}
    for name, told in {"together": data, "alone": data._replace(together=None)}.items():
        direction = whitened(changed, told)
        direction /= np.linalg.norm(direction)
        found = []
        for _ in range(80):
            noisy = problem.forgetful().simulate(*model, problem.with_load_noise(data.record, rng))
            own = problem.noise * rng.standard_normal(clean.shape)
            found.append(float(direction @ whitened(noisy - clean + own, told)))
        spread[name] = float(np.std(found))
    assert spread["together"] == pytest.approx(1.0, abs=0.25)  # of 80 draws it is known to 8 %
    assert spread["alone"] > 2.0
