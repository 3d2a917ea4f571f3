"""Joints of two coordinates: models identified from three records, then put in the true joint's place under unseen loads."""

from __future__ import annotations

import time as clock
import warnings
from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np

from bench.arrays import Array
from bench.errors import RangeWarning, SimulationError
from bench.identification.memory import MemorySettings, fit_memory
from bench.identification.network import fit_network
from bench.identification.polynomial import fit_polynomial
from bench.identification.restoring_force import JointData
from bench.recording import Recording, nmse
from bench.rig import Element, Rig, simulate
from bench.signals import Excitation
from memory.rivals import bouc_wen, lstm, narx
from memory.row import Progress, Row

FORMS: Mapping[str, MemorySettings] = {
    "memory, sliders": MemorySettings(form="sliders"),
    "memory, profiles": MemorySettings(form="profiles"),
}
"""The two forms of the joint with memory."""


class Test(NamedTuple):
    """An unseen test: what drives it, and what the true system did."""

    drive: Excitation
    seed: int
    true: Recording


class Bench(NamedTuple):
    """A system with a joint of two coordinates in it.

    Attributes:
        rig: The rig with given elements for its joint.
        axes: Joints or tendons that the joint acts on.
        forces: Forces of all elements of the joint (n, 2) in a record of it.
        tests: Unseen tests by loading.
        rate: Rate of the records [Hz].
    """

    rig: Callable[[tuple[Element, ...]], Rig]
    axes: tuple[str, str]
    tests: Mapping[str, Test]
    rate: float = 1000.0


def element_forces(record: Recording, elements: tuple[Element, ...], axes: tuple[str, str]) -> Array:
    """Forces of elements on each axis (n, 2)."""
    total = np.zeros((len(record.time), 2))
    for element in elements:
        for i, joint in enumerate(element.joints):
            suffix = f"_{i + 1}" if len(element.joints) > 1 else ""
            total[:, axes.index(joint)] += record[f"{element.name}/force{suffix}"]
    return total


def motion_of(record: Recording, element: str) -> Array:
    """States (n, 4) of an element of two coordinates in a record."""
    names = [f"{element}/{kind}_{i}" for kind in ("displacement", "velocity") for i in (1, 2)]
    return np.stack([record[name] for name in names], axis=1)


def closed_loop(bench: Bench, elements: tuple[Element, ...], true: tuple[Element, ...]) -> tuple[float, str]:
    """Worst NMSE of a force over tests and axes in motion [%], and a note; infinite where a test diverged."""
    worst, notes = 0.0, []
    for name, test in bench.tests.items():
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", RangeWarning)
                rng = np.random.default_rng(test.seed)
                record = simulate(bench.rig(elements), test.drive, rng=rng, sample_rate=bench.rate)
        except SimulationError as error:
            notes.append(f"{name}: diverged after {error.time:.2f} s")
            continue
        wanted = element_forces(test.true, true, bench.axes)
        given = element_forces(record, elements, bench.axes)
        scores = [nmse(wanted[:, i], given[:, i]) for i in (0, 1) if np.ptp(wanted[:, i]) > 0.0]
        worst = max(worst, *scores)
    return (float("inf") if notes else worst), "; ".join(notes)


def candidates(
    data: JointData, axes: tuple[str, str], progress: Progress
) -> dict[str, tuple[tuple[Element, ...], float, str]]:
    """Elements, fitting time and size of every model that is a force law."""
    assert data.time is not None
    found: dict[str, tuple[tuple[Element, ...], float, str]] = {}
    for label, settings in FORMS.items():
        progress(label)
        model = fit_memory(data.states, data.forces, time=data.time, settings=settings)
        element = Element(model.law, axes, model.theta, name="joint")
        size = f"{model.report.n_parameters} parameters, {model.report.n_states} states"
        found[label] = ((element,), model.report.seconds, size)
    for label, bounded in (("polynomial, order 3", False), ("polynomial, order 3, bounded", True)):
        fitted = fit_polynomial(data.states, data.forces, orders=3, bounded=bounded)
        element = Element(fitted.law, axes, fitted.theta, name="joint")
        found[label] = ((element,), fitted.report.seconds, f"{len(fitted.law.parameters)} parameters")
    progress("network")
    network = fit_network(data.states, data.forces, n_hidden=40, rng=np.random.default_rng(40))
    element = Element(network.law, axes, network.theta, name="joint")
    found["network, 40 units"] = ((element,), network.report.seconds, f"{network.report.n_weights} weights")
    progress("Bouc-Wen")
    begun = clock.monotonic()
    elements = bouc_wen(data.states, data.forces, data.time, axes)
    found["Bouc-Wen on each axis"] = (elements, clock.monotonic() - begun, "10 parameters, 2 states")
    return found


def scored(
    task: str,
    bench: Bench,
    data: JointData,
    true: tuple[Element, ...],
    limit: float | None,
    progress: Progress,
) -> list[Row]:
    """Rows of a task."""
    rows: list[Row] = []
    for label, (elements, seconds, size) in candidates(data, bench.axes, progress).items():
        progress(f"{label} in the joint's place")
        value, note = closed_loop(bench, elements, true)
        own = limit if label.startswith("memory") else None
        rows.append(
            Row(task, label, "closed loop, unseen: worst NMSE of a force", value, "%", own, note=note or size)
        )
        most = 300.0 if label.startswith("memory") else None
        rows.append(Row(task, label, "training time", seconds, "s", most))
    return rows + _along(task, bench, data, true, progress)


def _along(
    task: str, bench: Bench, data: JointData, true: tuple[Element, ...], progress: Progress
) -> list[Row]:
    """NARX and LSTM along the true motion of the unseen tests."""
    records = [test.true for test in bench.tests.values()]
    unseen = np.concatenate([motion_of(record, true[0].name) for record in records])
    forces = np.concatenate([element_forces(record, true, bench.axes) for record in records])
    time = np.concatenate([record.time - record.time[0] for record in records])
    assert data.time is not None
    seen = data.time
    rows = []
    for label, run in (
        ("NARX, degree 2", lambda: narx(data.states, data.forces, seen, unseen, time)),
        ("LSTM of equal size", lambda: lstm(data.states, data.forces, seen, unseen, time, size=130)),
    ):
        progress(label)
        found = run()
        if found is not None:
            value = max(nmse(forces[:, i], found[0][:, i]) for i in (0, 1))
            rows.append(
                Row(
                    task,
                    label,
                    "along the true unseen motion: worst NMSE of a force",
                    value,
                    "%",
                    note=f"{found[1]} weights",
                )
            )
    return rows
