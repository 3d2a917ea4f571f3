"""jointbench: a MuJoCo virtual test bench for nonlinear joints.

The names below are imported when first used, so that `import bench` costs milliseconds and a command pays only for
what it needs.

Example:
    >>> import bench
    >>> rig = bench.sdof_rig(bench.Element.of("gap", "carriage", stiffness=2000.0, clearance=0.005))  # doctest: +SKIP
"""

from __future__ import annotations

from importlib import import_module
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bench import kernel_cache

kernel_cache.provide(Path(__file__).parent)  # before numba is imported

try:
    __version__ = version("jointbench")
except PackageNotFoundError:  # run from a source tree that was never installed
    __version__ = "0+unknown"

_HOMES = {
    "BenchError": "bench.errors",
    "Channel": "bench.recording",
    "Recording": "bench.recording",
    "read_recording": "bench.record_files",
    "write_recording": "bench.record_files",
    "LAWS": "bench.laws",
    "ForceLaw": "bench.laws",
    "Parameter": "bench.laws",
    "Element": "bench.rig",
    "Rig": "bench.rig",
    "model_path": "bench.mjcf",
    "simulate": "bench.rig",
    "simulate_batch": "bench.rig",
    "sdof_rig": "bench.rig.library",
    "damper_rig": "bench.rig.library",
    "joint_rig": "bench.rig.library",
    "laboratory_joint_rig": "bench.rig.library",
    "chain_rig": "bench.rig.library",
    "Excitation": "bench.signals",
    "compare": "bench.reduction",
    "diagnose": "bench.discrepancy.intake.asking",
    "reduced_joint": "bench.reduction",
}

if TYPE_CHECKING:
    from bench.discrepancy.intake.asking import diagnose
    from bench.errors import BenchError
    from bench.laws import LAWS, ForceLaw, Parameter
    from bench.mjcf import model_path
    from bench.record_files import read_recording, write_recording
    from bench.recording import Channel, Recording
    from bench.reduction import compare, reduced_joint
    from bench.rig import Element, Rig, simulate, simulate_batch
    from bench.rig.library import chain_rig, damper_rig, joint_rig, laboratory_joint_rig, sdof_rig
    from bench.signals import Excitation

__all__ = [
    "LAWS",
    "BenchError",
    "Channel",
    "Element",
    "Excitation",
    "ForceLaw",
    "Parameter",
    "Recording",
    "Rig",
    "chain_rig",
    "compare",
    "damper_rig",
    "diagnose",
    "joint_rig",
    "laboratory_joint_rig",
    "model_path",
    "read_recording",
    "reduced_joint",
    "sdof_rig",
    "simulate",
    "simulate_batch",
    "write_recording",
]


def __getattr__(name: str) -> Any:
    if name == "reduce":  # the former name of reduced_joint, which warns
        return import_module("bench.reduction").reduce
    if name in _HOMES:
        return getattr(import_module(_HOMES[name]), name)
    raise AttributeError(f"module 'bench' has no attribute '{name}'")


def __dir__() -> list[str]:
    return sorted([*globals(), *_HOMES])
