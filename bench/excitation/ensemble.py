"""Ensembles: many linear structures with elements, integrated together in compiled code.

The method is MuJoCo's own (classical Runge-Kutta, commands held over a step, sensors read at the start of a step) on the
structure of `linear_structure`, and the forces are the laws' own kernels, so that a record equals MuJoCo's to rounding (a test
holds the two equal). An excitation design needs thousands of records of some dozens of rigs, and an environment's step a few
dozens of short ones; at 4 to 9 µs for a step of MuJoCo that would take minutes and milliseconds.

A member of an ensemble is one rig. `groups` name sets of members; each of several independent runs ("cases": the candidates of
a population, the environments of a vector environment) drives the members of one group with its own commands.
"""

from __future__ import annotations

import os
from collections import OrderedDict
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bench.errors import ModelError, ParameterError, UnknownNameError
from bench.excitation.linear_structure import AffineStructure, linear_structure
from bench.excitation.stepping import (
    STEPPING_LIMITS,
    Packed,
    integrate_cases,
)
from bench.native import Coordinate
from bench.rig import Rig


@dataclass(frozen=True)
class EnsembleSettings:
    """Numbers of `bench.excitation.ensemble`."""

    cases_a_thread: int = 4
    """Fewest cases for which another thread is worth its start of some 20 µs."""
    kept: int = 256


SETTINGS = EnsembleSettings()


def available_threads() -> int:
    """Number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@dataclass(eq=False)
class Ensemble:
    """Rigs of one layout with any elements, integrated together.

    Attributes:
        rigs: The members; the same MJCF, actuators and time step, elements as they like.
        channels: Names of the measured channels that records hold.
        actuators: Names of the actuators that are driven; the others get no command. All by default.
        threads: Threads to spread cases over.

    Raises:
        ModelError: The members differ in their MJCF or time step, or a member is not linear around its elements.
    """

    rigs: tuple[Rig, ...]
    channels: tuple[str, ...]
    actuators: tuple[str, ...] = ()
    threads: int = 1
    _packed: Packed = field(init=False, repr=False)

    def __post_init__(self) -> None:
        self.rigs, self.channels = tuple(self.rigs), tuple(self.channels)
        if not self.rigs:
            raise ParameterError("an ensemble needs at least one rig; none came")
        first = self.rigs[0]
        known = _frame_of(first).actuators
        self.actuators = tuple(self.actuators) or known
        for name in self.actuators:
            if name not in known:
                raise UnknownNameError(f"actuator of rig '{first.name}'", name, known)
        for rig in self.rigs:
            if (rig.mjcf, rig.folder, rig.timestep) != (first.mjcf, first.folder, first.timestep):
                raise ModelError(
                    f"rigs '{first.name}' and '{rig.name}' of one ensemble differ in their MJCF or timestep"
                )
        self._packed = _pack(self.rigs, self.channels, self.actuators)

    @property
    def timestep(self) -> float:
        """Integration step, and interval of the records [s]."""
        return self.rigs[0].timestep

    @property
    def packed(self) -> Packed:
        """The members as plain arrays."""
        return self._packed

    @property
    def n_actuators(self) -> int:
        """Number of commands."""
        return len(self.actuators)

    @property
    def n_states(self) -> int:
        """Number of states of a member: positions, velocities and hidden states."""
        return self._packed.start.shape[1]

    def start(self, members: NDArray[np.int64]) -> NDArray[np.float64]:
        """States at rest of the members ``(…, n_states)`` for indices of shape ``(…)``; −1 gives zeros."""
        return np.where((members >= 0)[..., None], self._packed.start[members], 0.0)

    def integrate(
        self,
        controls: NDArray[np.float64],
        states: NDArray[np.float64],
        *,
        members: NDArray[np.int64],
        counts: NDArray[np.int64],
        clock: NDArray[np.float64] | None = None,
    ) -> NDArray[np.float64]:
        """Advance cases by as many steps as there are commands.

        Args:
            controls: Commands by case ``(n_cases, n, n_actuators)``.
            states: States ``(n_cases, n_members, n_states)``, advanced in place.
            members: Members of each case ``(n_cases, n_members)``.
            counts: How many of them are real ``(n_cases,)``.
            clock: Time at the first command [s] ``(n_cases,)``; zero by default.

        Returns:
            Channels ``(n_cases, n_members, n, n_channels)`` at the start of each step; zero for members that are not real.
            They do not depend on the number of threads, to the last bit.
        """
        return integrate_cases(
            self._packed,
            controls,
            states,
            members=members,
            counts=counts,
            timestep=self.timestep,
            clock=clock,
            spread=self.spread,
        )

    def begin(self, task: Callable[[], None], n_cases: int) -> list[Future]:
        """Begin a task on half of the threads, where there are enough cases for them; the caller has the other half meanwhile."""
        others = min(self.threads // 2, n_cases // SETTINGS.cases_a_thread)
        return [self._pool.submit(task) for _ in range(others)]

    def spread(self, task: Callable[[int, int], None], n_cases: int) -> None:
        """Call ``task(first, last)`` for contiguous shares of the cases, over the threads where there are enough cases."""
        parts = min(self.threads, n_cases // SETTINGS.cases_a_thread)
        if parts <= 1:
            task(0, n_cases)
            return
        edges = np.linspace(0, n_cases, parts + 1).astype(int).tolist()
        pending = [self._pool.submit(task, a, b) for a, b in pairwise(edges[1:])]
        task(edges[0], edges[1])
        for future in pending:
            future.result()

    def record(self, controls: NDArray[np.float64]) -> NDArray[np.float64]:
        """Records of all members from rest, for one or several drives.

        Args:
            controls: Commands ``(n_cases, n, n_actuators)``.

        Returns:
            ``(n_cases, n_members, n, n_channels)``.
        """
        members = np.tile(np.arange(len(self.rigs)), (len(controls), 1))
        counts = np.full(len(controls), len(self.rigs))
        return self.integrate(controls, self.start(members), members=members, counts=counts)

    @cached_property
    def _pool(self) -> ThreadPoolExecutor:
        return ThreadPoolExecutor(self.threads - 1)

    def __reduce__(self) -> tuple:
        return (
            Ensemble,
            (self.rigs, self.channels, self.actuators, self.threads),
        )  # addresses of kernels hold in one process


class _Frame(NamedTuple):
    """What of a compiled rig does not depend on any parameter."""

    nv: int
    actuators: tuple[str, ...]
    coordinates: tuple[tuple[Coordinate, ...], ...]  # by element


_kept: OrderedDict[tuple, Any] = OrderedDict()
"""What was read off compiled rigs, the last used last: a rig that differs in parameters only need not be compiled."""


def _once(key: tuple, read: Callable[[], Any]) -> Any:
    if key not in _kept:
        _kept[key] = read()
    _kept.move_to_end(key)
    while len(_kept) > SETTINGS.kept:
        _kept.popitem(last=False)
    return _kept[key]


def _frame_of(rig: Rig) -> _Frame:
    layout = tuple((element.joints, element.inputs) for element in rig.elements)
    return _once(
        (rig.mjcf, rig.folder, layout),
        lambda: _Frame(rig.model.nv, rig.actuators, tuple(item.coordinates for item in rig.built.placed)),
    )


def _structure_of(rig: Rig, channels: tuple[str, ...]) -> AffineStructure:
    """The linear structure, which ordinary elements have no part in."""
    exact = tuple(element.name for element in rig.elements if element.exact)
    key = (rig.mjcf, rig.folder, rig.structure, rig.integrator, channels, exact)
    return _once(key, lambda: linear_structure(rig, channels))


def _pack(rigs: Sequence[Rig], channels: tuple[str, ...], actuators: tuple[str, ...]) -> Packed:
    nv, all_actuators, _ = _frame_of(rigs[0])
    driven = [all_actuators.index(name) for name in actuators]
    elements = max([1, *(len(rig.elements) for rig in rigs)])
    width = max([1, *(len(element.theta) for rig in rigs for element in rig.elements)])
    states = max(sum(len(element.law.states) for element in rig.elements) for rig in rigs)
    coordinates = max([1, *(element.law.n_coordinates for rig in rigs for element in rig.elements)])
    shape = (len(rigs), elements)
    table = np.zeros((len(rigs), nv + len(channels), 1 + 3 * nv + len(all_actuators)))
    none = np.zeros(0)
    p = Packed(
        none,
        none,
        none.astype(np.int64),
        none.astype(np.int64),
        np.zeros((*shape, 2), dtype=np.int64),
        np.zeros((*shape, 3), dtype=np.int64),
        np.zeros((*shape, coordinates, nv)),
        np.full((*shape, coordinates), STEPPING_LIMITS.motion, dtype=np.int64),
        np.zeros((*shape, width)),
        np.zeros((len(rigs), 2 * nv + states)),
    )
    for d, rig in enumerate(rigs):
        table[d] = np.concatenate(_structure_of(rig, channels))
        first = 0
        for k, (element, where) in enumerate(zip(rig.elements, _frame_of(rig).coordinates, strict=True)):
            law = element.law
            p.kernels[d, k] = law.force.address, law.rate.address if law.rate is not None else 0
            p.sizes[d, k] = law.n_coordinates, len(law.states), first
            p.theta[d, k, : len(element.theta)] = element.theta
            for j, coordinate in enumerate(where):
                if coordinate.is_input:
                    p.inputs[d, k, j] = _place(driven, coordinate.terms[0][0])
                else:
                    for _, dof, coefficient in coordinate.terms:
                        p.motion[d, k, j, dof] += coefficient
            first += len(law.states)
    return _reduced(p, table, rigs, nv, len(all_actuators), driven)


def _place(driven: list[int], actuator: int) -> int:
    """Place of an input among the driven actuators; `undriven` where it gets no command."""
    return driven.index(actuator) if actuator in driven else STEPPING_LIMITS.undriven


def _reduced(
    p: Packed, table: NDArray, rigs: Sequence[Rig], nv: int, n_actuators: int, driven: list[int]
) -> Packed:
    """The members without the degrees of freedom that no command and no element reaches: they stay at rest."""
    a = np.abs(table[:, :nv]).max(axis=0)
    push = np.abs(p.motion).max(axis=(0, 1))  # (J, nv)
    coupled = a[:, 1 : 1 + nv] + a[:, 1 + nv : 1 + 2 * nv] + a[:, -nv:] + push.T @ push > 0.0
    reached = push.any(axis=0) | (a[:, 0] > 0.0) | (a[:, [1 + 2 * nv + i for i in driven]] > 0.0).any(axis=1)
    for _ in range(nv):
        reached |= (coupled & reached).any(axis=1)
    kept = np.flatnonzero(reached) if reached.any() else np.arange(nv)
    start = np.zeros((len(rigs), 2 * len(kept) + p.start.shape[1] - 2 * nv))
    for d, rig in enumerate(rigs):
        states = [value for element in rig.elements for value in element.law.start()]
        start[d, 2 * len(kept) : 2 * len(kept) + len(states)] = states
    nx = start.shape[1]
    source = np.concatenate(
        [1 + kept, 1 + nv + kept, 1 + 2 * nv + n_actuators + kept, 1 + 2 * nv + np.array(driven)]
    ).astype(int)  # fmt: skip
    target = np.concatenate(
        [np.arange(2 * len(kept)), nx + np.arange(len(kept)), nx + len(kept) + np.arange(len(driven))]
    )
    lines = np.concatenate([kept, np.arange(nv, table.shape[1])])
    used = (table[:, lines][:, :, source] != 0.0).any(axis=0)
    return p._replace(
        constants=np.ascontiguousarray(table[:, lines, 0]),
        coefficients=np.ascontiguousarray(table[:, lines][:, :, source][:, used]),
        rows=np.concatenate([[0], np.cumsum(used.sum(axis=1))]).astype(np.int64),
        columns=target[np.nonzero(used)[1]].astype(np.int64),
        motion=np.ascontiguousarray(p.motion[..., kept]),
        start=start,
    )
