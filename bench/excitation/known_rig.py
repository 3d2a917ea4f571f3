"""A rig as it was found, where a test has come to: what a rest of the test would tell of it, and whether it keeps the limits."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bench.excitation.background import SETTINGS as BACKGROUND_SETTINGS
from bench.excitation.background import bare_and_backed, neighbours, term_rigs
from bench.excitation.family import Family
from bench.excitation.following import Follower
from bench.excitation.information import INFORMATION_LIMITS, accumulate
from bench.excitation.planner import SETTINGS as PLANNER_SETTINGS
from bench.excitation.planner import smaller
from bench.excitation.shaping import through_knots
from bench.excitation.station import Desk
from bench.excitation.stepping import Packed, integrate_cases


class KnownRig:
    """The rig as found, with its neighbours where the test has come to: what a rest of the test would tell of it.

    Attributes:
        n_rigs: It and its neighbours, one for each parameter and term of a background.
    """

    def __init__(self, family: Family, x: NDArray[np.float64], desk: Desk, follower: Follower) -> None:
        """Run a rig over the record so far.

        Args:
            family: Its hypothesis, with its background where it has one, see `with_background`.
            x: The rig ``(p,)``, standardised, without its background's coordinates.
            desk: What is allowed.
            follower: The record.
        """
        self._desk, self._own = desk, len(x)
        self.n_rigs = 1 + family.n_parameters
        backed = family.n_parameters > len(x)
        self._step = BACKGROUND_SETTINGS.step if backed else INFORMATION_LIMITS.step
        self._packs: list[Packed] = [neighbours(family, x, self._step)]
        if backed:
            self._packs.append(term_rigs(family, x, self._step))
        self._states = [packed.start[None].copy() for packed in self._packs]
        self._told = np.zeros((self.n_rigs - 1, self.n_rigs - 1))
        self._at = 0
        self.catch_up(follower)

    def catch_up(self, follower: Follower) -> None:
        """Run on to where the record has come."""
        if self._at < follower.length:
            controls = follower.controls[None, self._at : follower.length]
            self._told += self._information(self._run(controls, self._states))[0]
            self._at = follower.length

    def _run(self, controls: NDArray[np.float64], states: list[NDArray[np.float64]]) -> NDArray[np.float64]:
        """Channels of the rig and its neighbours ``(n_cases, n_rigs, n, n_channels)`` from states that are advanced."""
        both = [self._alone(controls, *each) for each in zip(self._packs, states, strict=True)]
        return both[0] if len(both) == 1 else np.concatenate(both, axis=1)

    def _alone(
        self, controls: NDArray[np.float64], packed: Packed, states: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Channels of as many rigs of a pack as there are states of."""
        cases, rigs, _ = states.shape
        timestep = self._desk.station.timestep
        return integrate_cases(
            packed, controls, states, members=np.arange(rigs)[None].repeat(cases, axis=0), counts=np.full(cases, rigs),
            timestep=timestep, clock=np.full(cases, self._at * timestep),
        )  # fmt: skip

    def _information(self, outputs: NDArray[np.float64]) -> NDArray[np.float64]:
        """Information of records about parameters and background ``(n_cases, n_rigs − 1, n_rigs − 1)``."""
        cases, size = len(outputs), self.n_rigs - 1
        fisher = np.zeros((cases, 1, size, size))
        unused = np.zeros((cases, 1, size)), np.zeros((cases, 1)), np.zeros((cases, 1))
        counts = np.full((cases, 1), size)
        accumulate(0, cases, outputs, counts, self._step, 1.0 / self._desk.noise, None, fisher, *unused)
        return np.where(np.isfinite(fisher), fisher, 0.0)[:, 0]

    def weigh(
        self, knots: NDArray[np.float64], follower: Follower
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Expected errors of rests of the test ``(k,)``, and their knots within the limits.

        A rest that leaves stroke or velocity on this rig is worth less than nothing, by how far it does.

        Args:
            knots: Of each rest ``(k, n_knots, n_actuators)``.
            follower: The record so far.
        """
        desk, station = self._desk, self._desk.station
        spent = station.timestep * np.sum(follower.controls[: self._at] ** 2, axis=0)
        left = np.maximum(desk.budget - spent, 0.0)
        last = np.tile(follower.controls[self._at - 1] / desk.force, (len(knots), 1))
        part = station.n_steps // station.n_knots

        def commands(knots: NDArray[np.float64]) -> NDArray[np.float64]:
            return desk.force * through_knots(knots, last, part)

        def reached(outputs: NDArray[np.float64]) -> NDArray[np.float64]:
            found = desk.reached(outputs[:, 0]).max(axis=1) / PLANNER_SETTINGS.margin
            return np.where(np.isfinite(found), found, np.inf)

        knots = np.clip(knots, -1.0, 1.0)
        energy = station.timestep * np.sum(commands(knots) ** 2, axis=1)
        with np.errstate(divide="ignore", invalid="ignore"):
            room = np.where(np.isfinite(left), np.sqrt(left / energy), 1.0 / np.max(np.abs(knots), axis=1))
        knots = np.clip(knots * np.where(np.isfinite(room), room, 0.0)[:, None], -1.0, 1.0)
        many = commands(knots)
        first = self._states[0][:, :1].repeat(len(knots), axis=0)
        over = reached(self._alone(many, self._packs[0], first))
        if over.max() > 1.0:
            knots = knots * np.where(over > 1.0, smaller(over), 1.0)[:, None, None]
            many = commands(knots)
        outputs = self._run(many, [states.repeat(len(knots), axis=0) for states in self._states])
        over = reached(outputs)
        told, p = self._told + self._information(outputs), self._own
        _, error = bare_and_backed(told[:, :p, :p], told[:, :p, p:])
        return np.where(over > 1.0, 1.0 + over, error), knots
