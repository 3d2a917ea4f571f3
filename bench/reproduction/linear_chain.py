"""D1: the linear chain of four bodies with eight degrees of freedom (Tasbihgoo 2006, Fig 5.3, eqs 5.47 to 5.53).

The matrices are assembled here from the printed equations in inches and pounds-force and solved exactly for a load held
over each step, by the matrix exponential: nothing in that solution comes from MuJoCo.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh, expm

from bench.demo.joint import excitation
from bench.figures import time_histories
from bench.laws.coupling import INCH, POUND_FORCE
from bench.progress import ShowProgress
from bench.recording import Recording, nmse
from bench.reproduction.estimates import fine
from bench.reproduction.imperial import STIFFNESS, imperial
from bench.reproduction.item import Item, Picture
from bench.reproduction.printed_figures import fig, panels
from bench.reproduction.verdict import Row, fact_row, value_row
from bench.rig import Element, Rig, simulate
from bench.rig.library import chain_rig
from bench.signals import Excitation


@dataclass(frozen=True)
class LinearChainSetup:
    """Numbers of `bench.reproduction.linear_chain`."""

    springs: tuple[float, ...] = (1000.0, 1e5, 200.0, 1e5, 1000.0)
    """k1 … k5, axial [lbf/in] and torsional [lbf in/rad] alike: mounts and joint of the deck, 1-2 and 3-4 as in the model."""
    dampers: tuple[float, ...] = (10.0, 10.0, 6.32, 10.0, 10.0)
    """c1 … c5 [lbf s/in], [lbf in s/rad]."""
    duration: float = 10.0
    duration_of_loads: float = 30.0
    seed: int = 51


LINEAR_CHAIN_SETUP = LinearChainSetup()


def rig(timestep: float = 1e-3) -> Rig:
    """The chain with a linear joint between bodies 2 and 3."""
    k, c = LINEAR_CHAIN_SETUP.springs[2], LINEAR_CHAIN_SETUP.dampers[2]
    axial = Element.of(
        "linear", "axial_23", name="axial_joint", stiffness=k * STIFFNESS, damping=c * STIFFNESS
    )
    torque = POUND_FORCE * INCH
    torsional = Element.of(
        "linear", "torsional_23", name="torsional_joint", stiffness=k * torque, damping=c * torque
    )
    return chain_rig(axial, torsional, timestep=timestep)


def matrix(values: tuple[float, ...], *, as_printed: bool = False) -> NDArray[np.float64]:
    """Stiffness or damping matrix (8, 8) of eqs 5.52, 5.53: axial and torsional coordinates of each body in turn.

    Args:
        values: k1 … k5 or c1 … c5.
        as_printed: With k1 + k2 repeated on the second body's axial coordinate, where the figure has k2 + k3.
    """
    one = np.zeros((4, 4))
    for i in range(4):
        one[i, i] = values[i] + values[i + 1]
        if i < 3:
            one[i, i + 1] = one[i + 1, i] = -values[i + 1]
    both = np.kron(one, np.eye(2)).astype(np.float64)
    if as_printed:
        both[2, 2] = values[0] + values[1]
    return both


def exact(loads: NDArray[np.float64], step: float, *, as_printed: bool = False) -> NDArray[np.float64]:
    """Displacements (n, 8) under loads on body 1 held over each step (n, 2), masses and inertias of one."""
    stiffness, damping = (
        matrix(values, as_printed=as_printed)
        for values in (LINEAR_CHAIN_SETUP.springs, LINEAR_CHAIN_SETUP.dampers)
    )
    system = np.zeros((18, 18))
    system[:8, 8:16] = np.eye(8)
    system[8:16, :8], system[8:16, 8:16] = -stiffness, -damping
    system[8, 16] = system[9, 17] = 1.0
    transition = expm(system * step)[:16]
    state = np.zeros(16)
    rows = np.empty((len(loads), 8))
    for k, load in enumerate(loads):
        rows[k] = state[:8]
        state = transition @ np.concatenate([state, load])
    return rows


def _channels() -> tuple[str, ...]:
    return tuple(f"{name}_{body}" for body in range(1, 5) for name in ("displacement", "rotation"))


def _deviation(record: Recording, solution: NDArray[np.float64]) -> float:
    """Largest difference over the largest displacement, of the worst coordinate."""
    pairs = zip(_channels(), solution.T, strict=True)
    return max(
        float(np.max(np.abs(record[name] - column)) / np.max(np.abs(column))) for name, column in pairs
    )


def _loads(whole: Excitation) -> Recording:
    """The loads of the whole excitation in pounds-force."""
    loads = whole.sample(np.random.default_rng(LINEAR_CHAIN_SETUP.seed)) / [POUND_FORCE, POUND_FORCE * INCH]
    names = {"axial load": "lbf", "torque": "lbf in"}
    arrays = dict(zip(names, loads.T, strict=True))
    return Recording.from_arrays(np.arange(len(loads)) / whole.sample_rate, arrays, units=names)


def _load_row(whole: Excitation) -> Row:
    """Whether the two loads are uncorrelated, and their level."""
    loads = _loads(whole)
    correlation = float(np.corrcoef(loads["axial load"], loads["torque"])[0, 1])
    # 720 independent samples (twice 12 Hz times 30 s): two standard deviations of a correlation of nothing
    limit = 2.0 / np.sqrt(2.0 * 12.0 * LINEAR_CHAIN_SETUP.duration_of_loads)
    return fact_row(
        "the two loads are uncorrelated",
        f"correlation {correlation:+.3f}; peaks {np.abs(loads['axial load']).max():.0f} lbf, {np.abs(loads['torque']).max():.0f} lbf in",
        abs(correlation) < limit,
        printed="uncorrelated; axes ±1000",
        source=f"{fig('5.6')}, caption",
        tolerance=f"below {limit:.3f}",
        reason="two standard deviations of the correlation of 720 independent pairs",
        chosen="loads drawn apart",
    )


def _convergence_rows(deviations: list[float]) -> list[Row]:
    """Simulations of three steps against the exact solution."""
    order = float(np.log2(deviations[1] / deviations[2]))
    rows = [
        value_row(
            f"largest difference from the matrix exponential over peak, {step} ms",
            "1",
            None,
            deviation,
            high=limit,
            reason="Runge-Kutta of order four, (ωh)⁴/120 a radian for 71 Hz, over some radians of ringing",
        )
        for step, deviation, limit in zip(("1", "0.5", "0.25"), deviations, (1e-3, 1e-4, 1e-5), strict=True)
    ]
    return [
        *rows,
        value_row(
            "order of convergence (Runge-Kutta: 4)",
            "1",
            None,
            order,
            low=3.5,
            high=4.5,
            reason="an order rounds to a whole number",
        ),
    ]


def _printed_row(loads: NDArray[np.float64], solution: NDArray[np.float64]) -> Row:
    """What becomes of the response with the stiffness matrix as it is typed in the text."""
    typed = exact(loads, 1e-3, as_printed=True)
    return fact_row(
        "stiffness matrix as printed is that of the figure",
        f"k1 + k2 stands on the second body; as typed, NMSE of body 3 {nmse(solution[:, 4], typed[:, 4]):.3g} %",
        bool(
            np.array_equal(
                matrix(LINEAR_CHAIN_SETUP.springs, as_printed=True), matrix(LINEAR_CHAIN_SETUP.springs)
            )
        ),
        printed="eqs 5.52, 5.53 and Fig 5.3",
        source="pp. 118 to 120, equations",
        tolerance="equal",
        reason="the figure defines the system",
        why="a slip of typing: the figure has k2 + k3 there, and so have we",
    )


def _frequency_rows() -> list[Row]:
    frequencies = np.sqrt(eigh(matrix(LINEAR_CHAIN_SETUP.springs), eigvals_only=True)[::2]) / (2.0 * np.pi)
    return [
        value_row(f"natural frequency {i + 1}", "Hz", None, float(f), reason="reported")
        for i, f in enumerate(frequencies)
    ]


def _pictures(whole: Excitation, record: Recording, solution: NDArray[np.float64]) -> tuple[Picture, ...]:
    reference = record.with_channels(dict(zip(_channels(), solution.T, strict=True)))
    return (
        Picture(
            "loads",
            "The loads on body 1: noise flat to 12 Hz, peaks 1000 lbf and 1000 lbf in, uncorrelated (Fig 5.6).",
            fine(time_histories({"loads": _loads(whole)}, ["axial load", "torque"])),
            panels("5.6", "ab"),
        ),
        Picture(
            "response",
            "Bodies 1 and 4 under axial load and torque: matrix exponential and MuJoCo overlaid.",
            fine(
                time_histories(
                    {"matrix exponential": reference, "MuJoCo, 1 ms": record},
                    ["displacement_1", "displacement_4", "rotation_1", "rotation_4"],
                    window=(4.0, LINEAR_CHAIN_SETUP.duration),
                )
            ),
        ),
    )


def run(progress: ShowProgress) -> Item:
    """Make the item."""
    whole = excitation(True, True)
    loads = whole.sample(np.random.default_rng(LINEAR_CHAIN_SETUP.seed))[
        : int(LINEAR_CHAIN_SETUP.duration * whole.sample_rate)
    ]
    inch_pound = loads / [POUND_FORCE, POUND_FORCE * INCH]
    deviations: list[float] = []
    records: list[Recording] = []
    solution = exact(inch_pound, 1e-3)
    for repeat in (1, 2, 4):
        progress(f"simulating at {1.0 / repeat:g} ms", 0.2 * repeat)
        drive = {name: np.repeat(loads[:, i], repeat) for i, name in enumerate(whole.names)}
        record = imperial(simulate(rig(1e-3 / repeat), drive, sample_rate=1000.0))
        records.append(record)
        deviations.append(_deviation(record, solution))
    text = (
        "Four unit masses and inertias, mounts of 1000 lbf/in and 10 lbf s/in at both ends and a linear "
        "joint of 200 lbf/in and 6.32 lbf s/in in the middle, as in the deck of appendix B.1 and alike "
        "in torsion, under noise flat to 12 Hz. The bars between bodies 1-2 and 3-4 are 1e5 lbf/in here "
        "(71 Hz) instead of the deck's practically rigid ones. Equation 5.52 repeats k1 + k2 on the "
        "second body, where its own figure has k2 + k3; the matrices are assembled from the figure."
    )
    searched = "stiffness of the bars between 1-2 and 3-4, lower than the deck's; seed and band of the loads"
    rows = (
        *_convergence_rows(deviations),
        _printed_row(inch_pound, solution),
        *_frequency_rows(),
        _load_row(whole),
    )
    return Item(text, rows, _pictures(whole, records[0], solution), searched)
