"""Forces never vanish and nothing foreign is run: other callbacks, models of other processes, crafted numbers, threads."""

from __future__ import annotations

import ctypes
import pickle
import subprocess
import sys
import threading
from pathlib import Path

import mujoco
import numba
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.stateful import (
    RuleBasedStateMachine,
    initialize,
    precondition,
    rule,
    run_state_machine_as_test,
)
from numba import types

from bench import Element, Rig, native, sdof_rig, simulate
from bench.errors import BenchError, ModelError, NativeError, SimulationError
from bench.laws import LAWS
from bench.native.encoding import HEADER
from bench.native.library import library
from bench.native.table import registered, slot

ELEMENTS = (
    Element.of("gap", "carriage", stiffness=3000.0, clearance=0.001),
    Element.of("bouc_wen", "carriage"),
    Element.of("cubic_stiffness", "carriage"),
)
DRIVE = {"shaker": 5.0 * np.sin(0.05 * np.arange(60))}


@numba.cfunc(types.void(types.int64, types.int64))
def _foreign_passive(model, data):
    pass


@numba.cfunc(types.float64(types.int64, types.int64, types.int32))
def _foreign_act_dyn(model, data, actuator):
    return 0.0


FOREIGN = {"passive": _foreign_passive, "act_dyn": _foreign_act_dyn}
WHICH = st.sampled_from(sorted(FOREIGN))


def _python_callback(*_):
    return 0.0


def rig_with(index: int) -> Rig:
    return sdof_rig(ELEMENTS[index], stiffness=100.0, damping=1.0)


def restore() -> None:
    for name in FOREIGN:
        getattr(mujoco, f"set_mjcb_{name}")(None)
        ctypes.c_void_p.in_dll(library(), f"mjcb_{name}").value = None
    native.install()


@pytest.fixture(autouse=True)
def _callbacks_restored():
    yield
    restore()


class Callbacks(RuleBasedStateMachine):
    """Whatever happens to MuJoCo's callbacks, a simulation has its forces to the last bit, or is refused before its first step."""

    @initialize()
    def begin(self) -> None:
        restore()
        self.expected = [simulate(rig_with(i), DRIVE)["displacement"] for i in range(len(ELEMENTS))]
        self.rigs = [(i, rig_with(i)) for i in range(len(ELEMENTS))]
        self.foreign: set[str] = set()

    def tried(self, call):
        """What a call returns, None where it is refused, as it must be while a foreign callback is in place."""
        if not self.foreign:
            return call()
        with pytest.raises(NativeError, match="in a process of its own"):
            call()
        return None

    @rule()
    def install(self) -> None:
        self.tried(native.install)

    @rule()
    def uninstall(self) -> None:
        native.uninstall()

    @rule(name=WHICH)
    def clear(self, name: str) -> None:
        getattr(mujoco, f"set_mjcb_{name}")(None)
        self.foreign.discard(name)

    @rule(name=WHICH, foreign=st.booleans())
    def change_from_c(self, name: str, foreign: bool) -> None:
        ctypes.c_void_p.in_dll(library(), f"mjcb_{name}").value = FOREIGN[name].address if foreign else None
        (self.foreign.add if foreign else self.foreign.discard)(name)

    @rule(name=WHICH, compiled=st.booleans())
    def set_foreign(self, name: str, compiled: bool) -> None:
        getattr(mujoco, f"set_mjcb_{name}")(FOREIGN[name].ctypes if compiled else _python_callback)
        self.foreign.add(name)

    @rule(index=st.integers(0, len(ELEMENTS) - 1))
    def build(self, index: int) -> None:
        rig = rig_with(index)
        if self.tried(lambda: rig.model) is not None:
            self.rigs[index] = (index, rig)

    @rule(place=st.integers(0, len(ELEMENTS) - 1))
    def run(self, place: int) -> None:
        index, rig = self.rigs[place]
        record = self.tried(lambda: simulate(rig, DRIVE))
        if record is not None:
            np.testing.assert_array_equal(record["displacement"], self.expected[index])

    @rule(place=st.integers(0, len(ELEMENTS) - 1))
    def pickle_rig(self, place: int) -> None:
        index, rig = self.rigs[place]
        self.rigs[place] = (index, pickle.loads(pickle.dumps(rig)))

    @precondition(lambda self: native.installed())
    @rule(place=st.integers(0, len(ELEMENTS) - 1), own=st.booleans())
    def step_a_pickled_model(self, place: int, own: bool) -> None:
        model = pickle.loads(pickle.dumps(self.rigs[place][1].model))
        data = mujoco.MjData(model)
        data.qvel[0] = 0.1
        if own:
            native.check_registered(model)
        else:
            start = model.numeric_adr[native.encoding.element_rows(model)[0]]
            model.numeric_data[start + 2] += 1.0
            with pytest.raises(NativeError, match="of another process"):
                native.check_registered(model)
        mujoco.mj_forward(model, data)
        assert np.isfinite(data.qfrc_passive).all() == own

    @rule()
    def run_in_threads(self) -> None:
        found: list[tuple[int, object]] = []

        def work(index: int, rig: Rig) -> None:
            try:
                found.append((index, simulate(rig, DRIVE)["displacement"]))
            except NativeError as error:
                found.append((index, error))

        threads = [threading.Thread(target=work, args=item) for item in self.rigs]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert len(found) == len(self.rigs)
        for index, result in found:
            assert isinstance(result, NativeError) == bool(self.foreign)
            if not self.foreign:
                np.testing.assert_array_equal(result, self.expected[index])

    def teardown(self) -> None:
        restore()


def test_no_order_of_events_takes_the_forces_away() -> None:
    settled = settings(max_examples=15, stateful_step_count=25, deadline=None)
    run_state_machine_as_test(Callbacks, settings=settled)


def test_a_callback_taken_away_during_a_run_voids_its_results() -> None:
    model = rig_with(0).model
    with pytest.raises(NativeError, match="while the bench was simulating"), native.running(model):
        mujoco.set_mjcb_passive(None)


def test_a_python_function_as_another_callback_is_refused() -> None:
    mujoco.set_mjcb_control(_python_callback)
    try:
        with pytest.raises(NativeError, match=r"mjcb_control is set.*set_mjcb_control"):
            simulate(rig_with(0), DRIVE)
    finally:
        mujoco.set_mjcb_control(None)


OTHER = """
import os, pickle, sys
import mujoco, numpy as np
from bench import Element, native, sdof_rig
from bench.errors import NativeError
rig = lambda law: sdof_rig(Element.of(law, "carriage"), stiffness=100.0)
rig("gap").model
if os.fork() == 0:  # the next law of the child and that of the parent have the same number
    with open("forked.pkl", "wb") as file:
        pickle.dump(rig("cubic_stiffness").model, file)
    os._exit(0)
os.wait()
own = rig("linear").model
forked = pickle.load(open("forked.pkl", "rb"))
assert forked.numeric_data[1] == own.numeric_data[1]
try:
    native.check_registered(forked)
except NativeError:
    print("refused")
mujoco.mj_saveModel(rig("bouc_wen").model, "other.mjb")
"""


def test_a_model_of_another_process_shows_nan_and_is_refused_until_bound(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-c", OTHER], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    assert done.stdout.split() == ["refused"]
    for model, law in (
        (pickle.loads((tmp_path / "forked.pkl").read_bytes()), LAWS["cubic_stiffness"]),
        (mujoco.MjModel.from_binary_path(str(tmp_path / "other.mjb")), LAWS["bouc_wen"]),
    ):
        native.install()
        with pytest.raises(NativeError, match=r"another process.*bind"):
            native.check_registered(model)
        with pytest.raises(NativeError), native.running(model):
            raise AssertionError("no step is run")
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        assert np.isnan(data.qfrc_passive).all()
        with pytest.raises(NativeError, match="checksum"):
            native.bind(model, [LAWS["gap"]])
        native.bind(model, [law])
        reference = sdof_rig(Element.of(law.name, "carriage"), stiffness=100.0).model
        ends = []
        for each in (model, reference):
            data = mujoco.MjData(each)
            data.qpos[0], data.qvel[0] = 0.02, 0.5
            mujoco.mj_step(each, data, 100)
            ends.append(data.qpos.copy())
        np.testing.assert_array_equal(*ends)


@pytest.mark.parametrize(
    ("entry", "value"), [(3, 2.0), (4, 3.0), (5, 7.0), (6, 9.0), (7, 1.0), (8, 1.0), (10, 1e9), (11, -1.0)]
)
def test_no_row_is_bound_that_was_changed(entry: int, value: float) -> None:
    rig = Rig("r", CRAFTED.format(actuator="", numeric=""), (Element.of("bouc_wen", "j"),))
    model = mujoco.MjModel.from_xml_string(rig.to_xml())
    start = int(model.numeric_adr[native.encoding.element_rows(model)[0]])
    assert model.numeric_data[start + entry] != value
    model.numeric_data[start + entry] = value
    with pytest.raises(NativeError, match="no element with the law 'bouc_wen'"):
        native.bind(model, [rig.elements[0].law])


_NUMBERS = st.one_of(
    st.integers(-3, 20), st.sampled_from([1e9, 2.0**31, 2.0**63, 1e300, float("nan"), float("inf"), -1e18])
)
_TWO = """<mujoco><worldbody><body><joint name="a" type="slide"/><geom size="1" mass="1"/></body></worldbody>
<actuator><general joint="a" dyntype="user" actdim="2" gainprm="0"/></actuator>
<custom><numeric name="any" size="24" data="0"/><numeric name="more" size="3" data="0"/></custom></mujoco>"""


@settings(max_examples=300, deadline=None)
@given(
    st.lists(_NUMBERS, min_size=24, max_size=24),
    st.sampled_from(["none", "own", "foreign"]),
    _NUMBERS,
    st.booleans(),
)
def test_crafted_numbers_reach_nothing_beyond_the_model(
    row: list[float], token: str, pointer: float, mark: bool
) -> None:
    """With this process's own token, too, every count and address is checked: NaN or a force, and no crash."""
    native.install()
    model = mujoco.MjModel.from_xml_string(_TWO)
    number, own = slot(LAWS["bouc_wen"])
    model.numeric_data[:24] = row
    model.numeric_data[0] = native.MAGIC
    if token != "none":
        model.numeric_data[1:3] = number, own if token == "own" else own - 1.0
        model.numeric_data[HEADER - 2] = 12.0  # theta lies within the row
    model.actuator_dynprm[0, :2] = (native.MAGIC if mark else 0.0, pointer)
    data = mujoco.MjData(model)
    data.qvel[0] = 0.1
    mujoco.mj_forward(model, data)
    if token != "own":
        assert np.isnan(data.qfrc_passive).all()


def test_tokens_are_random_and_no_number_passes_for_one() -> None:
    number, token = slot(LAWS["gap"])
    assert registered(number, token)
    assert token == int(token)
    assert token > 2**20  # smaller with a chance of 2^-33
    for other in (
        (number, token + 1),
        (number, 0.0),
        (number + 0.5, token),
        (-1, 0.0),
        (1e9, token),
        (float("nan"), token),
    ):
        assert not registered(*other)
    assert not registered(1023, float("nan"))


CRAFTED = """<mujoco><worldbody><body name="b"><joint name="j" type="slide"/><geom size="1" mass="1"/></body></worldbody>
<actuator><motor name="f" joint="j"/>{actuator}</actuator><custom>{numeric}</custom></mujoco>"""


@pytest.mark.parametrize(
    "parts",
    [
        {"numeric": f'<numeric name="calibration" data="{native.MAGIC:.0f} 999999999 3 0 0 6 0 1 0 0 1"/>'},
        {"numeric": f'<numeric name="{native.PREFIX}mine" data="1 2 3"/>'},
        {"actuator": f'<general name="x" joint="j" dyntype="user" dynprm="{native.MAGIC:.0f} 99999999"/>'},
        {"actuator": f'<general name="{native.PREFIX}mine" joint="j" dyntype="user"/>'},
    ],
)
def test_mjcf_that_marks_elements_of_its_own_is_refused(parts: dict[str, str]) -> None:
    mjcf = CRAFTED.format(**{"actuator": "", "numeric": "", **parts})
    for elements in ((), (Element.of("gap", "j"),)):
        with pytest.raises(ModelError, match="as an element of the bench"):
            _ = Rig("crafted", mjcf, elements).model
    native.install()
    model = mujoco.MjModel.from_xml_string(mjcf)  # by MuJoCo alone: no crash either
    data = mujoco.MjData(model)
    with native.quiet():
        mujoco.mj_step(model, data, 3)


def test_an_exported_rig_is_no_mjcf_of_another_rig() -> None:
    with pytest.raises(ModelError, match=r"marks numeric 'element/carriage.gap'.*bind"):
        _ = Rig("again", rig_with(0).to_xml()).model


DIVERGING = """
import os, sys, threading
import mujoco, numpy as np
from bench import Element, sdof_rig, simulate
from bench.errors import SimulationError
rig = sdof_rig(Element.of("gap", "carriage", stiffness=1e12, clearance=1e-4))
drive = {"shaker": 1e4 * np.random.default_rng(0).standard_normal(100)}
told = []
def work():
    for _ in range(25):
        try:
            simulate(rig, drive)
        except SimulationError as error:
            told.append((error.element, error.time))
threads = [threading.Thread(target=work) for _ in range(8)]
[t.start() for t in threads]
[t.join() for t in threads]
assert len(told) == 200 and len(set(told)) == 1, told
assert told[0][0] == "carriage.gap" and np.isfinite(told[0][1])
assert os.listdir() == []
if len(sys.argv) > 1:  # what is not the bench's own still speaks
    data = mujoco.MjData(rig.model)
    data.qpos[0] = 1e9
    mujoco.mj_step(rig.model, data, 50)
"""


@pytest.mark.slow
def test_diverging_in_threads_is_told_and_mujoco_is_silent(tmp_path: Path) -> None:
    for _ in range(3):  # a Python callback in the place of the compiled one aborted every time
        done = subprocess.run(
            [sys.executable, "-c", DIVERGING], cwd=tmp_path, capture_output=True, text=True, check=False
        )
        assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    done = subprocess.run(
        [sys.executable, "-c", DIVERGING, "x"], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    assert "WARNING" in done.stderr + done.stdout
    assert [path.name for path in tmp_path.iterdir()] == ["MUJOCO_LOG.TXT"]


def test_what_mujoco_gives_up_on_is_an_error_of_the_bench() -> None:
    rings = "".join(
        f'<body pos="{0.01 * i} 0 0"><freejoint/><geom size="1" mass="1"/></body>' for i in range(12)
    )
    mjcf = f"""<mujoco><size memory="20K"/><worldbody><body name="b"><joint name="j" type="slide"/><geom size="1" mass="1"/></body>
    {rings}</worldbody><actuator><motor name="f" joint="j"/></actuator></mujoco>"""
    with pytest.raises((SimulationError, ModelError)) as caught:
        simulate(Rig("crowded", mjcf), {"f": np.zeros(3)})
    assert isinstance(caught.value, BenchError)
