"""The only code that touches `mjcb_*`, ctypes and struct offsets: elements as native passive forces.

`install` sets two C callbacks for the process; `running` is what every run of MuJoCo by the bench happens within: the callbacks are
known to be in place, the models to be of this process, MuJoCo's clock stands still and its warnings are kept from the terminal.
`bind` makes a model that was pickled, copied or read from a file work in this process. A rig does all by itself.
"""

from __future__ import annotations

import ctypes
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import mujoco

from bench.errors import NativeError
from bench.laws.base import ForceLaw
from bench.native.callbacks import act_dyn, no_time, passive
from bench.native.encoding import (
    MAGIC,
    OWN,
    PREFIX,
    UNBOUND,
    Coordinate,
    bind_row,
    check_registered,
    claim_states,
    coordinate,
    element_rows,
    row_size,
    write_row,
)
from bench.native.layout import TESTED_MUJOCO
from bench.native.library import callback
from bench.native.quiet import quiet

__all__ = [
    "MAGIC",
    "OWN",
    "PREFIX",
    "TESTED_MUJOCO",
    "UNBOUND",
    "Coordinate",
    "bind",
    "check_registered",
    "claim_states",
    "coordinate",
    "install",
    "installed",
    "quiet",
    "row_size",
    "running",
    "uninstall",
    "untimed",
    "write_row",
]

_ours = {"passive": passive, "act_dyn": act_dyn}
# MuJoCo keeps the pointer only: these keep the code, and are what the setters take
_handles = {name: function.ctypes for name, function in _ours.items()}
_OTHERS = ("control", "sensor", "act_gain", "act_bias", "contactfilter", "time")
_lock = threading.Lock()


def _refusal(name: str) -> NativeError:
    theirs = getattr(mujoco, f"get_mjcb_{name}")()
    unknown = theirs is None or theirs is _handles[name]  # set from C: the bindings know nothing of it
    shown = f"a C function at {callback(name):#x}" if unknown else repr(theirs)
    return NativeError(
        f"mjcb_{name} is set by something else in this process, to {shown}; MuJoCo has one such callback for the whole process, and "
        "without its own the bench would leave the forces of all elements out. Nothing was simulated, and the callback is left as it "
        f"is. Run one of the two in a process of its own; or, when the other is done, call mujoco.set_mjcb_{name}(None): the bench "
        "puts its own back before its next run"
    )


def _refuse_python_callbacks() -> None:
    """Refuse Python functions among MuJoCo's other callbacks, which its threads cannot call."""
    for name in _OTHERS:
        theirs = getattr(mujoco, f"get_mjcb_{name}")()
        if theirs is not None and not isinstance(theirs, ctypes._CFuncPtr) and callback(name):
            raise NativeError(
                f"mjcb_{name} is set in this process, to the Python function {theirs!r}, which MuJoCo's threads cannot call. "
                f"Nothing was simulated; call mujoco.set_mjcb_{name}(None) when it is no longer needed, or set a C function"
            )


def installed() -> bool:
    """Whether both callbacks of the bench are what MuJoCo will call."""
    return all(callback(name) == function.address for name, function in _ours.items())


def install() -> None:
    """Set the callbacks `mjcb_passive` and `mjcb_act_dyn`; does nothing when they are in place already.

    Raises:
        NativeError: Another library's callback is in place, or a Python function as another of MuJoCo's callbacks. It is left as it is.
    """
    _refuse_python_callbacks()
    if installed():
        return
    with _lock:
        for name, function in _ours.items():
            if callback(name) not in {0, function.address}:
                raise _refusal(name)
        for name, handle in _handles.items():
            getattr(mujoco, f"set_mjcb_{name}")(handle)


def uninstall() -> None:
    """Remove the bench's callbacks, leaving foreign ones alone."""
    with _lock:
        for name, function in _ours.items():
            if callback(name) == function.address:
                getattr(mujoco, f"set_mjcb_{name}")(None)


class _StoppedClock:
    """How many callers want MuJoCo's clock to stand still; it goes on when the last of them is done."""

    def __init__(self) -> None:
        self.lock, self.callers, self.ours = threading.Lock(), 0, False

    def stop(self) -> None:
        with self.lock:
            if not self.callers:
                self.ours = mujoco.get_mjcb_time() is None
                if self.ours:
                    mujoco.set_mjcb_time(no_time.ctypes)
            self.callers += 1

    def go_on(self) -> None:
        with self.lock:
            self.callers -= 1
            if not self.callers and self.ours:
                mujoco.set_mjcb_time(None)  # MuJoCo's own clock


_clock = _StoppedClock()


@contextmanager
def untimed() -> Iterator[None]:
    """Within it MuJoCo does not measure its own time, a third of a step of a small model; `mjData.timer` stands still.

    MuJoCo reads the clock some forty times in a Runge-Kutta step. Another library's clock is left as it is. Safe to enter from
    several threads at a time.
    """
    _clock.stop()
    try:
        yield
    finally:
        _clock.go_on()


@contextmanager
def running(*models: mujoco.MjModel) -> Iterator[None]:
    """What every run of MuJoCo by the bench happens within; see the module. Safe to enter from several threads at a time.

    Args:
        *models: The models that are run.

    Raises:
        NativeError: Before the first step, where a foreign callback is in place (or a Python function as another one), or a model
            holds elements of another process; afterwards, where the callbacks have been taken away meanwhile.
    """
    install()
    for model in models:
        check_registered(model)
    with untimed(), quiet():
        yield
    for name, function in _ours.items():
        if callback(name) != function.address:
            raise NativeError(
                f"mjcb_{name} was removed or replaced by something else in this process while the bench was simulating; forces may "
                "be missing, and the results are thrown away. Run it again while nothing else sets MuJoCo's callbacks"
            )


def bind(model: mujoco.MjModel, laws: Sequence[ForceLaw]) -> None:
    """Write this process's law numbers into a model that was pickled, copied or read from a file; install the callbacks.

    Args:
        model: A model with elements.
        laws: The laws of its elements, in the order of the model's ``element/…`` numerics.

    Raises:
        NativeError: The number of laws differs from the number of elements, an element is not one of its law as the bench writes
            it, or a foreign callback is in place.
    """
    elements = element_rows(model)
    if len(elements) != len(laws):
        raise NativeError(f"the model holds {len(elements)} elements, but {len(laws)} laws were given")
    install()
    for numeric, law in zip(elements, laws, strict=True):
        bind_row(model, numeric, law)
