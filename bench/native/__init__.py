"""The only code that touches `mjcb_*`, ctypes and struct offsets: elements as native passive forces.

`install` sets two C callbacks once for the process; `bind` makes a model that was pickled, copied or read from a file
work in this process. A rig does both by itself.
"""

from __future__ import annotations

import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import mujoco

from bench.errors import NativeError
from bench.laws.base import ForceLaw
from bench.native.callbacks import act_dyn, no_time, passive
from bench.native.encoding import MAGIC, PREFIX, Coordinate, claim_states, coordinate, row_size, write_row
from bench.native.layout import TESTED_MUJOCO
from bench.native.table import slot

__all__ = [
    "MAGIC",
    "PREFIX",
    "TESTED_MUJOCO",
    "Coordinate",
    "bind",
    "claim_states",
    "coordinate",
    "install",
    "installed",
    "row_size",
    "uninstall",
    "untimed",
    "write_row",
]

_ours = {
    "passive": passive.ctypes,
    "act_dyn": act_dyn.ctypes,
}  # MuJoCo keeps the pointer only: these keep the code


def _current(name: str) -> object:
    return getattr(mujoco, f"get_mjcb_{name}")()


def installed() -> bool:
    """Whether both callbacks of the bench are in place."""
    return all(_current(name) is callback for name, callback in _ours.items())


def install() -> None:
    """Set the callbacks `mjcb_passive` and `mjcb_act_dyn`; does nothing when they are in place already.

    Raises:
        NativeError: Another library's callback is in place. It is left as it is.
    """
    for name, callback in _ours.items():
        present = _current(name)
        if present is not None and present is not callback:
            raise NativeError(
                f"mjcb_{name} is already set, to {present!r}; MuJoCo has one such callback for the whole process and the "
                f"bench does not overwrite it. Remove it with mujoco.set_mjcb_{name}(None) before using rigs with elements."
            )
    for name, callback in _ours.items():
        getattr(mujoco, f"set_mjcb_{name}")(callback)


def uninstall() -> None:
    """Remove the bench's callbacks, leaving foreign ones alone."""
    for name, callback in _ours.items():
        if _current(name) is callback:
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


def bind(model: mujoco.MjModel, laws: Sequence[ForceLaw]) -> None:
    """Write this process's law numbers into a model that was pickled, copied or read from a file; install the callbacks.

    Args:
        model: A model with elements.
        laws: The laws of its elements, in the order of the model's ``element/…`` numerics.

    Raises:
        NativeError: The number of laws differs from the number of elements, or a foreign callback is in place.
    """
    rows = [
        i
        for i in range(model.nnumeric)
        if model.numeric_size[i] and model.numeric_data[model.numeric_adr[i]] == MAGIC
    ]
    if len(rows) != len(laws):
        raise NativeError(f"the model holds {len(rows)} elements, but {len(laws)} laws were given")
    install()
    for numeric, law in zip(rows, laws, strict=True):
        model.numeric_data[model.numeric_adr[numeric] + 1] = slot(law)
        if law.states:
            claim_states(model, model.numeric(numeric).name.removeprefix(PREFIX))
