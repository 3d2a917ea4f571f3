"""The rigs: their numbers are the dissertation's, their mechanics are what a hand calculation says, nothing is nameless."""

from __future__ import annotations

import importlib.util
import sys
from fractions import Fraction
from functools import cache
from pathlib import Path
from types import ModuleType

import mujoco
import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.linalg import eigvals, expm

from bench import model_path
from bench.native.quiet import quiet

SCRIPTS = Path(__file__).resolve().parents[1] / "scripts"
MODELS = sorted(path.stem for path in model_path("sdof").parent.glob("*.xml"))

LBF = Fraction("4.4482216152605")
INCH = Fraction("0.0254")
MASS = LBF / INCH  # 1 lbf s2/in in kg; the same factor turns lbf/in into N/m and lbf s/in into N s/m
TURN = LBF * INCH  # 1 lbf in s2 in kg m2, 1 lbf in/rad in N m/rad, 1 lbf in s/rad in N m s/rad

OBJECTS = {
    "body": mujoco.mjtObj.mjOBJ_BODY,
    "jnt": mujoco.mjtObj.mjOBJ_JOINT,
    "geom": mujoco.mjtObj.mjOBJ_GEOM,
    "site": mujoco.mjtObj.mjOBJ_SITE,
    "cam": mujoco.mjtObj.mjOBJ_CAMERA,
    "light": mujoco.mjtObj.mjOBJ_LIGHT,
    "mat": mujoco.mjtObj.mjOBJ_MATERIAL,
    "tex": mujoco.mjtObj.mjOBJ_TEXTURE,
    "skin": mujoco.mjtObj.mjOBJ_SKIN,
    "tendon": mujoco.mjtObj.mjOBJ_TENDON,
    "u": mujoco.mjtObj.mjOBJ_ACTUATOR,
    "sensor": mujoco.mjtObj.mjOBJ_SENSOR,
}

JOINT_RIG = {
    "joints": ["axial_1", "torsional_1", "axial_2", "torsional_2"],
    "actuators": ["force", "torque"],
    "tendons": ["axial", "torsional"],
    "sensors": [
        *(
            "load_cell_force",
            "load_cell_torque",
            "displacement_1",
            "rotation_1",
            "displacement_2",
            "rotation_2",
        ),
        *("axial", "torsional", "axial_velocity", "torsional_velocity", "acceleration_1", "acceleration_2"),
        *("angular_acceleration_1", "angular_acceleration_2"),
    ],
}
CONTRACT: dict[str, dict[str, list[str]]] = {
    "sdof": {
        "joints": ["carriage", "clamp"],
        "actuators": ["shaker", "normal_force"],
        "tendons": [],
        "sensors": ["load_cell", "displacement", "velocity", "acceleration", "normal_force_cell"],
    },
    "damper": {
        "joints": ["piston"],
        "actuators": ["drive_position", "drive_velocity", "drive_feedforward"],
        "tendons": [],
        "sensors": ["displacement", "velocity", "acceleration"],
    },
    "joint": JOINT_RIG,
    "joint_laboratory": JOINT_RIG,
    "chain": {
        "joints": [f"{kind}_{i}" for i in range(1, 5) for kind in ("axial", "torsional")],
        "actuators": ["force", "torque"],
        "tendons": [f"{kind}_{pair}" for pair in ("12", "23", "34") for kind in ("axial", "torsional")],
        "sensors": [
            "load_cell_force",
            "load_cell_torque",
            "displacement_4",
            "rotation_4",
            "axial_23",
            "torsional_23",
        ],
    },
    "joint_6dof": {
        "joints": ["x_1", "y_1", "z_1", "rx_1", "ry_1", "rz_1", "x", "y", "z", "rx", "ry", "rz"],
        "actuators": ["force_x", "force_y", "force_z", "torque_x", "torque_y", "torque_z"],
        "tendons": [],
        "sensors": ["load_cell_force_x", "x", "rz", "rz_velocity", "acceleration_2"],
    },
    "free_slide": {
        "joints": ["carriage"],
        "actuators": ["motor"],
        "tendons": [],
        "sensors": ["load_cell", "displacement", "velocity", "acceleration"],
    },
}


def load(name: str) -> tuple[mujoco.MjModel, mujoco.MjData]:
    model = mujoco.MjModel.from_xml_path(str(model_path(name)))
    return model, mujoco.MjData(model)


@cache
def script(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, SCRIPTS / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # dataclasses look their module up there
    spec.loader.exec_module(module)
    return module


def names(model: mujoco.MjModel, kind: str) -> list[str]:
    return [mujoco.mj_id2name(model, OBJECTS[kind], i) for i in range(getattr(model, f"n{kind}"))]


def mass_matrix(model: mujoco.MjModel, data: mujoco.MjData) -> NDArray[np.float64]:
    mujoco.mj_forward(model, data)
    matrix = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, matrix)
    return matrix


def passive(
    model: mujoco.MjModel, qpos: NDArray[np.float64], qvel: NDArray[np.float64]
) -> NDArray[np.float64]:
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:] = qpos, qvel
    mujoco.mj_forward(model, data)
    return np.array(data.qfrc_passive)


def linear(model: mujoco.MjModel) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Mass, damping and stiffness matrix about rest, the last two by central differences."""
    step, n, rest = 1e-3, model.nv, np.zeros(model.nv)
    stiffness, damping = np.zeros((n, n)), np.zeros((n, n))
    for i, unit in enumerate(np.eye(n) * step):
        stiffness[:, i] = -(passive(model, unit, rest) - passive(model, -unit, rest)) / (2.0 * step)
        damping[:, i] = -(passive(model, rest, unit) - passive(model, rest, -unit)) / (2.0 * step)
    return mass_matrix(model, mujoco.MjData(model)), damping, stiffness


def frequencies(model: mujoco.MjModel) -> NDArray[np.float64]:
    """Undamped natural frequencies in ascending order [rad/s]."""
    mass, _, stiffness = linear(model)
    squares = eigvals(stiffness, mass).real
    return np.sqrt(np.sort(np.maximum(squares, 0.0)))


def pair(mount: float, coupling: float, inertia: float) -> list[float]:
    """Frequencies of mount - body - coupling - body, from the quadratic for omega^2 [rad/s]."""
    root = np.sqrt(mount**2 + 4.0 * coupling**2)
    return [float(np.sqrt((mount + 2.0 * coupling + sign * root) / (2.0 * inertia))) for sign in (-1.0, 1.0)]


@pytest.mark.parametrize("name", MODELS)
def test_every_object_has_a_name(name: str) -> None:
    model, _ = load(name)
    for kind in OBJECTS:
        assert all(names(model, kind)), f"{name}: a {kind} has no name"
    assert model.nkey == model.neq == model.npair == 0


@pytest.mark.parametrize("name", MODELS)
def test_names_relied_upon(name: str) -> None:
    model, _ = load(name)
    contract = CONTRACT[name]
    assert names(model, "jnt") == contract["joints"]
    assert names(model, "u") == contract["actuators"]
    assert names(model, "tendon") == contract["tendons"]
    assert set(contract["sensors"]) <= set(names(model, "sensor"))
    assert {"overview", "side"} <= set(names(model, "cam"))
    assert model.nlight >= 1
    assert model.vis.global_.offwidth >= 1400
    assert model.vis.global_.offheight >= 800


@pytest.mark.parametrize("name", MODELS)
def test_settings(name: str) -> None:
    model, _ = load(name)
    assert model.opt.integrator == mujoco.mjtIntegrator.mjINT_RK4
    assert model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_AUTORESET
    assert not model.opt.gravity.any()
    assert not model.actuator_ctrllimited.any()
    assert not model.geom_contype.any()
    assert not model.geom_conaffinity.any()


@pytest.mark.parametrize("name", MODELS)
def test_divergence_stays_visible(name: str) -> None:
    """Not reset to the start: the caller must be able to see that a run went wrong."""
    model, data = load(name)
    data.qvel[0] = 1e12
    with quiet():
        for _ in range(5):
            mujoco.mj_step(model, data)
    assert data.time == pytest.approx(5 * model.opt.timestep)
    assert not abs(data.qpos[0]) < 1e6  # huge, or NaN


@pytest.mark.parametrize("name", MODELS)
def test_nothing_touches_anything(name: str, rng: np.random.Generator) -> None:
    model, data = load(name)
    model.opt.disableflags &= ~int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    for _ in range(5):
        data.qpos[:] = rng.uniform(-0.1, 0.1, model.nq)
        mujoco.mj_forward(model, data)
        assert data.ncon == 0
        assert data.nefc == 0


@pytest.mark.parametrize("name", MODELS)
def test_drawing_weighs_nothing(name: str) -> None:
    """All mass is that of the bodies that move, stated in their inertials."""
    model, _ = load(name)
    moving = set(model.jnt_bodyid.tolist())
    assert {i for i in range(model.nbody) if model.body_mass[i] > 0.0} == moving


def test_joint_rig_has_the_decks_numbers() -> None:
    model, _ = load("joint")
    for i in (1, 2):
        body, axial, torsional = (
            model.body(f"body_{i}"),
            model.joint(f"axial_{i}"),
            model.joint(f"torsional_{i}"),
        )
        # 1e-12: decimal numbers in the file against exact fractions, both rounded to double precision.
        assert body.mass[0] == pytest.approx(float(2 * MASS), rel=1e-12)
        assert body.inertia[0] == pytest.approx(float(2 * TURN), rel=1e-12)
        assert axial.stiffness[0] == pytest.approx(float(1000 * MASS), rel=1e-12)
        assert axial.damping[0] == pytest.approx(float(10 * MASS), rel=1e-12)
        assert torsional.stiffness[0] == pytest.approx(float(1000 * TURN), rel=1e-12)
        assert torsional.damping[0] == pytest.approx(float(10 * TURN), rel=1e-12)
    assert not model.tendon_stiffness.any()
    assert not model.tendon_damping.any()


def test_chain_has_the_decks_numbers() -> None:
    model, _ = load("chain")
    for i in range(1, 5):
        body, axial, torsional = (
            model.body(f"body_{i}"),
            model.joint(f"axial_{i}"),
            model.joint(f"torsional_{i}"),
        )
        mounted = i in (1, 4)
        assert body.mass[0] == pytest.approx(float(MASS), rel=1e-12)
        assert body.inertia[0] == pytest.approx(float(TURN), rel=1e-12)
        assert axial.stiffness[0] == pytest.approx(float(1000 * MASS * mounted), rel=1e-12)
        assert axial.damping[0] == pytest.approx(float(10 * MASS * mounted), rel=1e-12)
        assert torsional.stiffness[0] == pytest.approx(float(1000 * TURN * mounted), rel=1e-12)
        assert torsional.damping[0] == pytest.approx(float(10 * TURN * mounted), rel=1e-12)
    for coupling, factor in (("12", 1), ("23", 0), ("34", 1)):
        axial, torsional = model.tendon(f"axial_{coupling}").id, model.tendon(f"torsional_{coupling}").id
        assert model.tendon_stiffness[axial] == pytest.approx(float(100_000 * MASS * factor), rel=1e-12)
        assert model.tendon_damping[axial] == pytest.approx(float(10 * MASS * factor), rel=1e-12)
        assert model.tendon_stiffness[torsional] == pytest.approx(float(100_000 * TURN * factor), rel=1e-12)
        assert model.tendon_damping[torsional] == pytest.approx(float(10 * TURN * factor), rel=1e-12)


def test_mass_matrices_of_the_shaft_rigs_are_diagonal() -> None:
    for name, mass, inertia in (("joint", 2 * MASS, 2 * TURN), ("chain", MASS, TURN)):
        model, data = load(name)
        matrix = mass_matrix(model, data)
        np.testing.assert_allclose(
            matrix, np.diag(np.tile([float(mass), float(inertia)], model.nv // 2)), rtol=1e-12
        )


# Frequencies: central differences of forces that are exactly linear leave round-off only, hence 1e-8; a stiffness of
# exactly zero may come out as 1e-10 of the largest, hence the absolute part.


def test_frequencies_of_the_joint_rig() -> None:
    model, _ = load("joint")
    np.testing.assert_allclose(frequencies(model), np.sqrt(1000.0 / 2.0), rtol=1e-8)


def test_frequencies_of_the_laboratory_joint() -> None:
    model, _ = load("joint_laboratory")
    expected = np.sort(np.sqrt([5000.0 / 4.0, 4.0 / 0.012, 4e5 / 6.0, 250.0 / 0.02]))
    np.testing.assert_allclose(frequencies(model), expected, rtol=1e-8)


def test_frequencies_of_the_chain() -> None:
    """In the deck's units axial and torsional motion have the same numbers, and both halves are mirror images."""
    model, _ = load("chain")
    np.testing.assert_allclose(frequencies(model), np.repeat(pair(1e3, 1e5, 1.0), 4), rtol=1e-8)


def test_frequencies_of_the_six_degree_of_freedom_rig() -> None:
    """Without an element body 2 floats: six zeros, and the table on its mounts as if it were alone."""
    model, _ = load("joint_6dof")
    table = np.sqrt([8e4 / 50.0, 8e4 / 50.0, 12e4 / 50.0, 3600.0 / 1.2, 4800.0 / 1.6, 4200.0 / 2.4])
    found = frequencies(model)
    # 1e-3 rad/s: the square root of round-off in a zero eigenvalue.
    np.testing.assert_allclose(found[:6], 0.0, atol=1e-3)
    np.testing.assert_allclose(found[6:], np.sort(table), rtol=1e-7)


@pytest.mark.parametrize("name", ["sdof", "free_slide", "damper"])
def test_the_tested_coordinate_is_free(name: str) -> None:
    """What resists the motion is the element alone."""
    model, _ = load(name)
    _, damping, stiffness = linear(model)
    assert stiffness[0, 0] == 0.0
    assert damping[0, 0] == 0.0


def test_six_relative_coordinates_are_relative(rng: np.random.Generator) -> None:
    """Moving the table rigidly leaves the pose of body 2 in the frame of body 1 unchanged."""
    model, data = load("joint_6dof")
    data.qpos[6:] = rng.uniform(-0.05, 0.05, 6)
    poses = []
    for table in (np.zeros(6), rng.uniform(-0.05, 0.05, 6)):
        data.qpos[:6] = table
        mujoco.mj_forward(model, data)
        one, two = data.body("body_1"), data.body("body_2")
        turn = one.xmat.reshape(3, 3)
        poses.append(
            np.concatenate([turn.T @ (two.xpos - one.xpos), (turn.T @ two.xmat.reshape(3, 3)).ravel()])
        )
    np.testing.assert_allclose(poses[0], poses[1], atol=1e-14)


@pytest.mark.parametrize(
    ("name", "pairs"), [("joint", {"": (1, 2)}), ("chain", {"_12": (1, 2), "_23": (2, 3), "_34": (3, 4)})]
)
def test_tendons_are_relative_states(
    name: str, pairs: dict[str, tuple[int, int]], rng: np.random.Generator
) -> None:
    model, data = load(name)
    data.qpos[:], data.qvel[:] = rng.normal(size=(2, model.nv))
    mujoco.mj_forward(model, data)
    for kind in ("axial", "torsional"):
        for suffix, (one, two) in pairs.items():
            first, second = data.joint(f"{kind}_{one}"), data.joint(f"{kind}_{two}")
            # 1e-14: a difference of two numbers of order one.
            assert data.sensor(f"{kind}{suffix}").data[0] == pytest.approx(
                second.qpos[0] - first.qpos[0], abs=1e-14
            )
            velocity = data.sensor(f"{kind}_velocity{suffix}").data[0]
            assert velocity == pytest.approx(second.qvel[0] - first.qvel[0], abs=1e-14)


def test_laboratory_joint_covers_the_printed_ranges() -> None:
    """0.2 in and 0.2 rad at 60 lbf and 60 lbf in across the joint take 10 to 20 % more than that from the drives."""
    model, _ = load("joint_laboratory")
    for kind, force, motion in (
        ("axial", float(60 * LBF), float(Fraction("0.2") * INCH)),
        ("torsional", float(60 * TURN), 0.2),
    ):
        second = force / model.joint(f"{kind}_2").stiffness[0]
        drive = force + model.joint(f"{kind}_1").stiffness[0] * (motion + second)
        assert 1.1 < drive / force < 1.2


def chain_matrices() -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Equations 5.51 to 5.53 assembled from figure 5.3, in the order of the joints, without the element 2-3."""
    mount, bar = np.diag([1.0, 0.0, 0.0, 1.0]), np.zeros((4, 4))
    bar[:2, :2] = bar[2:, 2:] = [[1.0, -1.0], [-1.0, 1.0]]
    unit = np.diag([float(MASS), float(TURN)])
    return (
        np.kron(np.eye(4), unit),
        np.kron(10.0 * mount + 10.0 * bar, unit),
        np.kron(1e3 * mount + 1e5 * bar, unit),
    )


def test_chain_matrices_are_those_of_the_figure() -> None:
    model, _ = load("chain")
    for found, expected in zip(linear(model), chain_matrices(), strict=True):
        # Round-off of central differences, relative to the largest entry.
        np.testing.assert_allclose(found, expected, atol=1e-9 * np.abs(expected).max())


def test_chain_converges_to_the_exact_solution(rng: np.random.Generator) -> None:
    """Against the matrix exponential of the hand-assembled system, fourth order."""
    model, data = load("chain")
    mass, damping, stiffness = chain_matrices()
    inverse = np.linalg.inv(mass)
    system = np.block([[np.zeros((8, 8)), np.eye(8)], [-inverse @ stiffness, -inverse @ damping]])
    start = np.concatenate([rng.normal(size=8) * 0.01, rng.normal(size=8)])
    exact = expm(0.2 * system) @ start
    errors = []
    for step in (1e-3, 5e-4):
        model.opt.timestep = step
        mujoco.mj_resetData(model, data)
        data.qpos[:], data.qvel[:] = start[:8], start[8:]
        for _ in range(round(0.2 / step)):
            mujoco.mj_step(model, data)
        errors.append(np.linalg.norm(np.concatenate([data.qpos, data.qvel]) - exact) / np.linalg.norm(exact))
    assert errors[0] / errors[1] > 2**3.7  # order 4, less a little for the higher orders at omega dt = 0.45
    # Phase error (omega dt)^5 / 120 a step of the 71 Hz modes: 200 x 1.5e-4 = 3 %, damped to less by 0.2 s.
    assert errors[0] < 0.03


@pytest.mark.parametrize("name", ["sdof", "joint", "joint_laboratory", "chain", "joint_6dof"])
def test_energy_decays(name: str, rng: np.random.Generator) -> None:
    model, data = load(name)
    model.opt.enableflags |= int(mujoco.mjtEnableBit.mjENBL_ENERGY)
    data.qpos[:], data.qvel[:] = 0.01 * rng.normal(size=model.nq), 0.1 * rng.normal(size=model.nv)
    energy = []
    for _ in range(500):
        mujoco.mj_step(model, data)
        energy.append(data.energy.sum())
    # 1e-9: nothing but round-off and the integrator's own error may add energy between two steps.
    assert np.all(np.diff(energy) <= 1e-9 * energy[0])
    assert energy[-1] < 0.9 * energy[0]


def test_free_slide_keeps_its_momentum() -> None:
    model, data = load("free_slide")
    data.qvel[0] = 0.3
    for _ in range(1000):
        mujoco.mj_step(model, data)
    # 1e-12: a thousand sums of round-off.
    assert data.qvel[0] == pytest.approx(0.3, rel=1e-12)
    assert data.qpos[0] == pytest.approx(0.3, rel=1e-12)
    assert model.body("carriage").mass[0] == 95.1


def test_sdof_sensors() -> None:
    model, data = load("sdof")
    data.ctrl[:] = [7.0, 40.0]
    data.joint("carriage").qpos[0], data.joint("carriage").qvel[0] = 0.01, -0.2
    mujoco.mj_forward(model, data)
    assert data.sensor("load_cell").data[0] == 7.0
    assert data.sensor("normal_force_cell").data[0] == 40.0
    assert data.sensor("displacement").data[0] == 0.01
    assert data.sensor("velocity").data[0] == -0.2
    # 1 kg; the accelerometer computes it through body accelerations, hence round-off.
    np.testing.assert_allclose(data.sensor("acceleration").data, [7.0, 0.0, 0.0], atol=1e-12)


def test_normal_force_shows_at_the_clamp_and_nowhere_else() -> None:
    model, data = load("sdof")
    data.ctrl[1] = 50.0
    for _ in range(2000):
        mujoco.mj_step(model, data)
        assert data.joint("carriage").qpos[0] == 0.0
    # 50 N on 10 N/mm; 2 s are more than 200 time constants.
    assert data.joint("clamp").qpos[0] == pytest.approx(0.005, rel=1e-9)
    clamp, inertia = model.joint("clamp"), model.body("clamp").mass[0]
    # Critically damped within 1 %: it neither rings nor creeps.
    assert clamp.damping[0] == pytest.approx(2.0 * np.sqrt(clamp.stiffness[0] * inertia), rel=0.01)


@pytest.mark.parametrize("name", ["joint", "joint_laboratory", "chain"])
def test_joint_rig_sensors(name: str) -> None:
    model, data = load(name)
    data.ctrl[:] = [300.0, 5.0]
    data.joint("torsional_1").qpos[0] = 0.3
    mujoco.mj_forward(model, data)
    assert data.sensor("load_cell_force").data[0] == 300.0
    assert data.sensor("load_cell_torque").data[0] == 5.0
    # The x components are the joints' own accelerations, whatever the angle; round-off only.
    assert data.sensor("acceleration_1").data[0] == pytest.approx(data.joint("axial_1").qacc[0], rel=1e-12)
    assert data.sensor("angular_acceleration_1").data[0] == pytest.approx(
        data.joint("torsional_1").qacc[0], rel=1e-12
    )
    assert data.sensor("rotation_1").data[0] == 0.3


@pytest.mark.parametrize("name", MODELS)
def test_springs_are_up_to_date(name: str) -> None:
    """The shipped skins are what `scripts/make_springs.py` makes of the sites, and every vertex follows its bodies fully."""
    model, _ = load(name)
    fresh = script("make_springs").springs(model_path(name))
    assert len(fresh) == model.nskin
    for i, content in enumerate(fresh.values()):
        first, count = model.skin_vertadr[i], model.skin_vertnum[i]
        vertices = np.frombuffer(content, "<f4", 3 * count, 16).reshape(-1, 3)
        # Single precision of positions up to about 1 m.
        np.testing.assert_allclose(model.skin_vert[first : first + count], vertices, atol=1e-6)
        weight = np.zeros(count)
        for bone in range(model.skin_boneadr[i], model.skin_boneadr[i] + model.skin_bonenum[i]):
            part = slice(
                model.skin_bonevertadr[bone], model.skin_bonevertadr[bone] + model.skin_bonevertnum[bone]
            )
            weight[model.skin_bonevertid[part]] += model.skin_bonevertweight[part]
        np.testing.assert_allclose(weight, 1.0, atol=1e-6)


@pytest.mark.parametrize("name", MODELS)
def test_displaced_pictures_name_real_joints(name: str) -> None:
    model, _ = load(name)
    data = script("render_models").pose(model, name)
    assert np.count_nonzero(data.qpos) == len(script("render_models").POSES[name])
