"""Seconds at equal error against SciPy's integrators on the joint rig, and what elements cost beside bare MuJoCo.

A setting counts where it and all finer ones of its grid stay below the error wanted, so that no lucky one is chosen; the
same rule holds for every method. The peer's right-hand side is compiled (the law's own kernel inside a numba function),
its absolute tolerances follow each state's size, and its best method is taken. Under commands held over each sample,
`solve_ivp` is started anew at every sample with a sensible first step, or integrates across them with the step limited to
one: whichever is quicker.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from mujoco.batch import Batch

from bench import Element, Rig, joint_rig, sdof_rig
from bench.arrays import Array
from bench.identification.linear_rig import LinearRig
from benchmarks.joint_problem import CHANNELS, JointProblem, problems
from benchmarks.timing import Row, interleave, ratio_row

ERROR = 1e-6
N_BATCH = 64
STEPS = 10_000
PEER_SHARE, MUJOCO_SHARE = 4, 16
"""The loop over `solve_ivp`, and MuJoCo, run this many of the batch, and their seconds are scaled up: it is the same work
each time, and minutes otherwise."""
METHODS = ("RK45", "DOP853", "LSODA", "Radau", "BDF")
RTOLS = tuple(factor * 10.0**power for power in range(-4, -11, -1) for factor in (1.0, 0.5, 0.2))
SUBSTEPS = (1, 2, 5, 10, 20, 50, 100, 200)
"""MuJoCo's steps a millisecond."""


@dataclass(frozen=True)
class Setting:
    """A way to simulate that is accurate enough.

    Attributes:
        label: What it is.
        run: Simulates once.
        seconds: Seconds of one run, for choosing only.
        error: Its error.
    """

    label: str
    run: Callable[[], Any]
    seconds: float
    error: float


def _loosest(
    problem: JointProblem, label: str, make: Callable[[float], Callable[[], Array]], grid: Sequence[float]
) -> Setting | None:
    """The loosest setting of a grid (loosest first) that is accurate enough together with all finer ones."""
    found = None
    make(grid[0])()  # compiles and fills caches
    for value in reversed(grid):
        run = make(value)
        start = time.perf_counter()
        result = run()
        seconds = time.perf_counter() - start
        error = problem.error(result) if result.shape == problem.reference.shape else np.inf
        if not error <= ERROR:
            break
        found = Setting(f"{label} {value:g}", run, seconds, error)
    return found


def _peer(problem: JointProblem) -> tuple[Setting, Callable[..., Array]]:
    """The quickest of `solve_ivp`'s methods that is accurate enough."""
    settings = []
    for method in METHODS:
        for restart in (True, False) if problem.driven else (True,):

            def make(rtol: float, method: str = method, restart: bool = restart) -> Callable[..., Array]:
                return partial(problem.scipy, method, rtol, problem.scale, restart=restart)

            # an implicit or multistep method that is started a thousand times a second is no contender
            if restart and problem.driven and method in {"LSODA", "Radau", "BDF"}:
                continue
            setting = _loosest(
                problem, f"{method}{' restarted' if restart and problem.driven else ''} rtol", make, RTOLS
            )
            if setting is not None:
                settings.append(setting)
    best = min(settings, key=lambda setting: setting.seconds)
    return best, best.run


def _rows_of(problem: JointProblem, repeats: int) -> list[Row]:
    peer, solve = _peer(problem)
    rig = LinearRig.of(joint_rig(timestep=1e-3 if problem.driven else 1e-3 * problem.every), CHANNELS)
    ours = {
        "MuJoCo RK4": _loosest(
            problem, "steps a millisecond", lambda n: lambda: problem.mujoco(int(n))[0], SUBSTEPS
        ),
        "compiled loop": _loosest(
            problem, "tolerance", lambda tol: partial(problem.compiled, rig, tol), RTOLS
        ),
    }
    rng = np.random.default_rng(64)
    speeds = np.array(problem.speeds) + rng.uniform(0.0, 0.2, (N_BATCH, 4)) * np.array([1.0, 10.0, 1.0, 10.0])
    rows = []
    for label, setting in ours.items():
        if setting is None:
            raise RuntimeError(f"no setting of {label} reaches an error of {ERROR:g} in {problem.name}")
        detail = {
            "ours": setting.label, "our_error": setting.error, "peer": peer.label, "peer_error": peer.error,
        }  # fmt: skip
        limit = "≥ 50" if label == "compiled loop" else ""
        # one run of ours alone is shorter than what a task switch costs: as many as take the peer's time
        count = max(1, round(peer.seconds / setting.seconds))
        single = interleave({"ours": partial(_times, count, setting.run), "peer": peer.run}, repeats)
        rows.append(
            ratio_row(
                f"{problem.name}, error 1e-6, one record: {label}",
                single["ours"] / count,
                single["peer"],
                limit=limit,
                meaning="seconds of solve_ivp's best method / ours, equal error",
                detail=detail,
            )
        )
        value = float(setting.label.split()[-1])
        tasks: dict[str, Callable[[], Any]] = {"peer": partial(_loop, solve, speeds[:PEER_SHARE])}
        if label == "MuJoCo RK4":
            tasks["ours"] = partial(problem.mujoco, int(value), speeds=speeds[:MUJOCO_SHARE], threads=2)
        else:
            # as often as the peer's loop runs, for a timing of milliseconds
            tasks["ours"] = partial(_times, PEER_SHARE, partial(problem.many, rig, value, speeds))
        many = interleave(tasks, max(5, repeats // 3))
        rows.append(
            ratio_row(
                f"{problem.name}, error 1e-6, {N_BATCH} records, 2 threads: {label}",
                many["ours"] * (1.0 / PEER_SHARE if label == "compiled loop" else N_BATCH / MUJOCO_SHARE),
                many["peer"] * (N_BATCH / PEER_SHARE),
                limit=limit,
                meaning="seconds of a loop over solve_ivp / ours over two threads, equal error",
                detail=detail,
            )
        )
    return rows


def _times(count: int, run: Callable[[], Any]) -> None:
    for _ in range(count):
        run()


def _loop(solve: Callable[..., Array], speeds: Array) -> None:
    for row in speeds:
        solve(speeds=row)


def _step(batch: Batch) -> None:
    batch.bind("qvel")[:] = 0.3
    batch.step(nstep=STEPS)


def _stepping(repeats: int) -> list[Row]:
    """Steps a second with elements against the same MJCF without any, and of the compiled loop against MuJoCo."""
    gap = Element.of("gap", "carriage", stiffness=3000.0, clearance=0.003)
    hysteresis = Element.of("bouc_wen", "carriage", A=800.0, beta=60.0, gamma=40.0, n=1.0)
    rigs: dict[str, tuple[Rig, tuple[str, ...], int]] = {
        "SDOF gap": (sdof_rig(gap, mass=2.0, stiffness=1500.0, damping=4.0), ("displacement", "velocity"), 2),
        "SDOF gap + Bouc-Wen": (
            sdof_rig(gap, hysteresis, mass=2.0, stiffness=1500.0, damping=4.0), ("displacement", "velocity"), 2,
        ),
        "deck joint": (joint_rig(), CHANNELS, 2),
    }  # fmt: skip
    rows = []
    for name, (rig, channels, n_actuators) in rigs.items():
        with_elements, bare = Batch(rig.model, 8, 2), Batch(rig.with_(elements=()).model, 8, 2)
        compiled = LinearRig.of(rig, channels)
        commands = np.random.default_rng(8).standard_normal((STEPS, n_actuators))
        tasks = {
            "with": partial(_step, with_elements),
            "bare": partial(_step, bare),
            "compiled": partial(_eight, compiled, commands),
        }
        seconds = interleave(tasks, repeats)
        rows.append(
            ratio_row(
                f"{name}, RK4, Batch over 2 threads: elements against none",
                seconds["with"],
                seconds["bare"],
                meaning="step rate of the rig / of the same MJCF without its elements and their states",
            )
        )
        rows.append(
            ratio_row(
                f"{name}, RK4, 2 threads: compiled loop against MuJoCo",
                seconds["compiled"],
                seconds["with"],
                limit="≥ 10",
                meaning="step rate of the compiled whole-record loop / of mujoco.batch, same rig",
            )
        )
    return rows


def _eight(rig: LinearRig, commands: Array) -> None:
    with ThreadPoolExecutor(2) as pool:
        list(pool.map(lambda _: rig.simulate(commands), range(8)))


def rows(repeats: int = 15) -> list[Row]:
    """Rows of the group."""
    return [row for problem in problems() for row in _rows_of(problem, repeats)] + _stepping(repeats)
