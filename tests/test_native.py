"""The native layer: right forces, any thread count, nothing foreign touched."""

from __future__ import annotations

import pickle
import subprocess
import sys

import mujoco
import numpy as np
import pytest
from mujoco import rollout
from mujoco.batch import Batch

from bench import Element, Rig, native
from bench.errors import ModelError, NativeError, UnknownNameError
from bench.laws import LAWS
from bench.native.layout import check_version

MJCF = """<mujoco><option gravity="0 0 0"/><worldbody>
<body name="a"><joint name="x" type="slide"/><geom size=".1" mass="2" contype="0" conaffinity="0"/></body>
<body name="b" pos="0 1 0"><joint name="y" type="slide"/><geom size=".1" mass="1" contype="0" conaffinity="0"/></body>
<body name="c" pos="0 2 0"><joint name="r" type="ball"/><geom size=".1" mass="1" contype="0" conaffinity="0"/></body>
</worldbody><tendon><fixed name="between"><joint joint="y" coef="1"/><joint joint="x" coef="-1"/></fixed>
<spatial name="string"><site site="s1"/><site site="s2"/></spatial></tendon>
<actuator><motor name="push" joint="x"/><motor name="squeeze" joint="y" gear="0"/></actuator></mujoco>"""
MJCF = MJCF.replace('<geom size=".1" mass="2"', '<site name="s1"/><geom size=".1" mass="2"').replace(
    '<body name="b" pos="0 1 0">', '<body name="b" pos="0 1 0"><site name="s2"/>'
)


@pytest.fixture(autouse=True)
def _callbacks_restored():
    yield
    for name in ("passive", "act_dyn"):
        getattr(mujoco, f"set_mjcb_{name}")(None)
    native.install()


def passive_force(
    rig: Rig, qpos: dict[str, float], qvel: dict[str, float], ctrl: dict[str, float] | None = None
):
    data = mujoco.MjData(rig.model)
    for name, value in qpos.items():
        data.joint(name).qpos = value
    for name, value in qvel.items():
        data.joint(name).qvel = value
    for name, value in (ctrl or {}).items():
        data.actuator(name).ctrl = value
    mujoco.mj_forward(rig.model, data)
    return data


def test_element_on_a_joint_pushes_back_with_the_laws_force():
    rig = Rig("r", MJCF, (Element.of("linear", "x", stiffness=10.0, damping=2.0),))
    data = passive_force(rig, {"x": 0.3}, {"x": -0.5})
    assert data.joint("x").qfrc_passive[0] == -(10.0 * 0.3 - 2.0 * 0.5)


def test_element_on_a_fixed_tendon_acts_on_both_joints_with_opposite_sign():
    rig = Rig("r", MJCF, (Element.of("linear", "between", stiffness=10.0, damping=0.0),))
    data = passive_force(rig, {"x": 0.1, "y": 0.4}, {})
    assert data.joint("x").qfrc_passive[0] == pytest.approx(3.0, rel=1e-14)
    assert data.joint("y").qfrc_passive[0] == pytest.approx(-3.0, rel=1e-14)


def test_element_with_several_coordinates_and_states_and_elements_add_up():
    elements = (
        Element.of("gap_coupling", "x", "y"),
        Element.of("bouc_wen", "y"),
        Element.of("linear", "y", stiffness=7.0, damping=0.0),
    )
    rig = Rig("r", MJCF, elements)
    data = mujoco.MjData(rig.model)
    data.joint("x").qpos, data.joint("y").qpos, data.joint("x").qvel, data.joint("y").qvel = (
        0.2,
        0.5,
        0.1,
        -0.2,
    )
    data.act[0] = 3.0
    mujoco.mj_forward(rig.model, data)
    q, v, f = np.array([0.2, 0.5]), np.array([0.1, -0.2]), np.zeros(2)
    LAWS["gap_coupling"].force(0.0, q, v, None, elements[0].theta, f)
    assert data.joint("x").qfrc_passive[0] == pytest.approx(-f[0], rel=1e-14)
    assert data.joint("y").qfrc_passive[0] == pytest.approx(-f[1] - 3.0 - 3.5, rel=1e-14)
    rate = np.zeros(1)
    assert LAWS["bouc_wen"].rate is not None
    LAWS["bouc_wen"].rate(0.0, q[1:], v[1:], np.array([3.0]), elements[1].theta, rate)
    assert data.act_dot[0] == pytest.approx(rate[0], rel=1e-14)


def test_law_reads_a_control_as_normal_force():
    rig = Rig("r", MJCF, (Element.of("controlled_friction", "x", inputs=("squeeze",)),))
    law, theta = LAWS["controlled_friction"], rig.elements[0].theta
    data = passive_force(rig, {}, {"x": 0.5}, {"squeeze": 20.0})
    f = np.zeros(2)
    law.force(0.0, np.array([0.0, 20.0]), np.array([0.5, 0.0]), None, theta, f)
    assert f[0] > 0.0
    assert data.joint("x").qfrc_passive[0] == -f[0]


def test_results_are_bit_identical_over_thread_counts_in_rollout_and_batch():
    rig = Rig("r", MJCF, (Element.of("bouc_wen", "x"), Element.of("gap", "between", clearance=0.01)))
    model, n = rig.model, 24
    size = mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS)
    start = np.zeros((n, size))
    start[:, 1 + model.nq] = np.linspace(-1.0, 1.0, n)
    states = [
        rollout.rollout(model, [mujoco.MjData(model) for _ in range(threads)], start, nstep=300)[0]
        for threads in (1, 2, 3)
    ]
    assert np.ptp(states[0][:, -1, 1]) > 0.0
    assert np.array_equal(states[0], states[1])
    assert np.array_equal(states[0], states[2])
    finals = []
    for threads in (1, 2, 3):
        batch = Batch(model, n, threads)
        batch.bind("qvel")[:, 0] = np.linspace(-1.0, 1.0, n)
        batch.step(nstep=300)
        finals.append(batch.bind("qpos").copy())
    assert np.array_equal(finals[0], finals[1])
    assert np.array_equal(finals[0], finals[2])
    assert np.array_equal(finals[0], states[0][:, -1, 1 : 1 + model.nq])


def test_each_simulation_of_a_batch_has_its_own_parameters():
    rig = Rig("r", MJCF, (Element.of("linear", "x", stiffness=10.0, damping=0.0),))
    stiffnesses = np.array([1.0, 5.0, 20.0])
    batch = Batch(rig.model, 3, 2)
    batch.expand("numeric_data")[:, rig.built.placed[0].theta] = stiffnesses
    batch.bind("qvel")[:, 0] = 1.0
    batch.step(nstep=200)
    for i, stiffness in enumerate(stiffnesses):
        single = rig.with_element(rig.elements[0].with_(stiffness=stiffness))
        data = mujoco.MjData(single.model)
        data.qvel[0] = 1.0
        mujoco.mj_step(single.model, data, 200)
        assert batch.bind("qpos")[i, 0] == data.qpos[0]


def test_models_without_elements_are_untouched():
    plain = mujoco.MjModel.from_xml_string(MJCF)
    foreign = mujoco.MjModel.from_xml_string(
        MJCF.replace("</mujoco>", '<custom><numeric name="mine" data="1 2 3 4 5 6 7 8"/></custom></mujoco>')
    )
    native.install()
    for model in (plain, foreign):
        data = mujoco.MjData(model)
        data.qvel[0] = 1.0
        mujoco.mj_forward(model, data)
        assert not data.qfrc_passive.any()


def test_foreign_callback_is_never_overwritten():
    native.uninstall()

    def theirs(model, data):
        return None

    mujoco.set_mjcb_passive(theirs)
    with pytest.raises(NativeError, match=r"set by something else.*set_mjcb_passive"):
        native.install()
    assert mujoco.get_mjcb_passive() is theirs
    with pytest.raises(NativeError):
        _ = Rig("r", MJCF, (Element.of("linear", "x"),)).model
    native.uninstall()
    assert mujoco.get_mjcb_passive() is theirs


def test_install_twice_is_the_same_as_once():
    native.install()
    before = mujoco.get_mjcb_passive()
    native.install()
    assert mujoco.get_mjcb_passive() is before
    assert native.installed()


def test_without_its_clock_mujoco_steps_the_same_and_a_foreign_clock_stays():
    rig = Rig("r", MJCF, (Element.of("bouc_wen", "x"),))

    def stepped() -> mujoco.MjData:
        data = mujoco.MjData(rig.model)
        data.qvel[0] = 1.0
        mujoco.mj_step(rig.model, data, 50)
        return data

    timed = stepped()
    with native.untimed(), native.untimed():
        untimed = stepped()
    np.testing.assert_array_equal(untimed.qpos, timed.qpos)
    assert untimed.timer[mujoco.mjtTimer.mjTIMER_STEP].duration == 0.0
    assert timed.timer[mujoco.mjtTimer.mjTIMER_STEP].duration > 0.0
    assert mujoco.get_mjcb_time() is None
    mujoco.set_mjcb_time(lambda: 1.0)
    try:
        theirs = mujoco.get_mjcb_time()
        with native.untimed():
            assert mujoco.get_mjcb_time() is theirs
        assert mujoco.get_mjcb_time() is theirs
    finally:
        mujoco.set_mjcb_time(None)


def test_model_of_another_process_shows_nan_until_bound():
    rig = Rig("r", MJCF, (Element.of("bouc_wen", "x"),))
    foreign = mujoco.MjModel.from_xml_string(rig.to_xml())
    rows = foreign.numeric(native.PREFIX + rig.elements[0].name)
    assert rows.data[0] == native.MAGIC
    assert rows.data[1] == -1.0
    data = mujoco.MjData(foreign)
    mujoco.mj_forward(foreign, data)
    assert np.isnan(data.qfrc_passive[0])
    native.bind(foreign, [rig.elements[0].law])
    data = mujoco.MjData(foreign)
    data.qvel[0] = 1.0
    reference = mujoco.MjData(rig.model)
    reference.qvel[0] = 1.0
    mujoco.mj_step(foreign, data, 50)
    mujoco.mj_step(rig.model, reference, 50)
    assert data.qpos[0] == pytest.approx(reference.qpos[0], rel=1e-12)
    with pytest.raises(NativeError, match="1 elements, but 2 laws"):
        native.bind(foreign, [rig.elements[0].law] * 2)


def test_rig_survives_pickling():
    rig = Rig("r", MJCF, (Element.of("bouc_wen", "x"),))
    copy = pickle.loads(pickle.dumps(rig))
    a, b = (passive_force(r, {"x": 0.1}, {"x": 1.0}).act_dot[0] for r in (rig, copy))
    assert a == b != 0.0


def test_untested_mujoco_is_refused_with_the_tested_range():
    check_version(mujoco.__version__)
    for version in ("3.3.0", "5.0.0"):
        with pytest.raises(NativeError, match=f"MuJoCo {version} is installed.*4.0.0 <= version"):
            check_version(version)


@pytest.mark.parametrize(
    ("element", "error", "message"),
    [
        (Element.of("linear", "z"), UnknownNameError, "unknown joint or tendon.*'z'"),
        (Element.of("linear", "r"), ModelError, "'r' is a ball joint"),
        (Element.of("linear", "string"), ModelError, "'string' is spatial"),
        (
            Element.of("controlled_friction", "x", inputs=("pull",)),
            UnknownNameError,
            "unknown actuator 'pull'",
        ),
    ],
)
def test_element_that_does_not_fit_the_model_says_so(element, error, message):
    with pytest.raises(error, match=message):
        _ = Rig("r", MJCF, (element,)).model


def test_compiled_code_is_cached_between_processes():
    """A second process must find the callbacks compiled: no compilation of the passive callback."""
    code = "from bench.native.callbacks import passive, act_dyn;print(passive.cache_hits, act_dyn.cache_hits)"
    subprocess.run([sys.executable, "-c", code], check=True, capture_output=True)
    second = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    assert second.stdout.split() == ["1", "1"]


def test_mujocos_clock_stands_still_until_the_last_caller_is_done() -> None:
    with native.untimed():
        with native.untimed():
            assert mujoco.get_mjcb_time() is not None
        assert mujoco.get_mjcb_time() is not None
    assert mujoco.get_mjcb_time() is None
