"""Tests run on many rigs at once: by a policy that shapes the excitation as it measures, or by commands made before.

Both are measured with the same noise and end at the same limit switch, which makes them comparable. The rigs are packed members of an
`Ensemble` or `Family`, equal to MuJoCo to rounding.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bench.errors import ParameterError
from bench.excitation.acting import ActingPolicy
from bench.excitation.estimation import Records
from bench.excitation.station import Desk, Station
from bench.excitation.stepping import Packed, integrate_cases


class Runs(NamedTuple):
    """Tests on m rigs."""

    records: Records
    ideal: NDArray[np.float64]  # (m, n, n_channels) without noise
    reached: NDArray[np.float64]  # (m, 2) largest measured stroke and velocity, as fractions of the limits
    violations: NDArray[np.int64]  # (m,) windows with stroke or velocity beyond its limit
    windows: NDArray[np.int64]  # (m,) windows run until the end or the limit switch
    energy: NDArray[np.float64]  # (m,) spent, the largest share of the actuators' budgets


def disturbances(station: Station, m: int, rng: np.random.Generator) -> NDArray[np.float64]:
    """Noise of the sensors during m tests ``(m, n_windows + 1, n_steps, n_channels)``, and last in the rest before."""
    noise = np.array(list(station.noise.values()))
    return noise * rng.standard_normal((m, station.n_windows + 1, station.n_steps, len(noise)))


def run_policy(
    policy: ActingPolicy,
    packed: Packed,
    disturbance: NDArray[np.float64],
    *,
    station: Station | None = None,
    question: int = 0,
    memory: Any = None,
) -> Runs:
    """Run a policy on rigs from rest.

    Args:
        policy: The policy.
        packed: The rigs, one case each; their channels are the station's.
        disturbance: Noise of the sensors, see `disturbances`.
        station: Where they stand; by default where the policy was trained.
        question: Place of the question asked among the station's.
        memory: What `policy.memory` gave for as many tests; made here where it is of no further use.

    Raises:
        ParameterError: The policy does not fit the station.
    """
    station = station or policy.station
    m, places = len(packed.start), np.arange(len(packed.start))
    desk = Desk(station, m)
    trained = policy.station
    if desk.n_observations != trained.n_observations or desk.shaping.width != trained.width:
        raise ParameterError(
            f"policy '{policy.name}' takes {trained.n_observations} observations and gives {trained.width} actions; "
            f"this station has {desk.n_observations} and {desk.shaping.width}"
        )
    asked = np.full(m, question)
    states = packed.start.copy()
    n, width = station.n_steps, len(station.actuators)
    controls = np.zeros((m, station.n_samples, width))
    ideal = np.zeros((m, station.n_samples, len(station.channels)))
    observation = desk.observe(
        places, disturbance[:, -1], np.zeros((m, n, width)), np.zeros((m, desk.shaping.width)), asked
    )
    memory = policy.memory(m) if memory is None else memory
    for window in range(station.n_windows):
        actions = policy.act(observation, memory).astype(float)
        commands, _ = desk.commands(places, actions)
        span = slice(window * n, (window + 1) * n)
        clock = np.full(m, window * n * station.timestep)
        outputs = integrate_cases(
            packed,
            commands,
            states[:, None],
            members=places[:, None],
            counts=np.ones(m, dtype=np.int64),
            timestep=station.timestep,
            clock=clock,
        )[:, 0]
        controls[:, span], ideal[:, span] = commands, outputs
        measured = np.nan_to_num(outputs) + disturbance[:, window]
        desk.book(places, measured)
        desk.window += 1
        observation = desk.observe(places, measured, commands, actions, asked)
    return finish(station, controls, ideal, disturbance)


def run_commands(
    station: Station, controls: NDArray[np.float64], packed: Packed, disturbance: NDArray[np.float64]
) -> Runs:
    """Run the same commands on rigs from rest.

    Args:
        station: Where the rigs stand.
        controls: Commands ``(n_samples, n_actuators)``.
        packed: The rigs, one case each.
        disturbance: Noise of the sensors, see `disturbances`.
    """
    m = len(packed.start)
    many = np.broadcast_to(controls, (m, *controls.shape)).copy()
    ideal = integrate_cases(
        packed,
        many,
        packed.start[:, None].copy(),
        members=np.arange(m)[:, None],
        counts=np.ones(m, dtype=np.int64),
        timestep=station.timestep,
    )[:, 0]
    return finish(station, many, ideal, disturbance)


def finish(
    station: Station,
    controls: NDArray[np.float64],
    ideal: NDArray[np.float64],
    disturbance: NDArray[np.float64],
) -> Runs:
    """What a limit switch, which ends a test at the end of its window, leaves of whole records."""
    m, n_windows = len(controls), station.n_windows
    desk = Desk(station, m)
    measured = ideal + disturbance[:, :n_windows].reshape(ideal.shape)
    cut = np.where(np.isfinite(measured), measured, np.inf).reshape(
        m * n_windows, station.n_steps, ideal.shape[2]
    )
    reached = desk.reached(cut).reshape(m, n_windows, 2)
    stopped = reached[:, :, 0] > 1.0
    windows = np.where(stopped.any(axis=1), np.argmax(stopped, axis=1) + 1, n_windows)
    run = np.arange(n_windows) < windows[:, None]
    lengths = windows * station.n_steps
    # a record that diverged counts up to there; what is not finite would spoil sums
    lost = np.any(~np.isfinite(measured), axis=2)
    lengths = np.where(np.any(lost, axis=1), np.minimum(lengths, np.argmax(lost, axis=1)), lengths)
    energy = station.timestep * np.sum(controls**2, axis=1) / desk.budget
    return Runs(
        Records(controls, np.nan_to_num(measured), np.maximum(lengths, 1)),
        ideal,
        np.max(np.where(run[:, :, None], reached, 0.0), axis=1),
        np.sum((reached > 1.0).any(axis=2) & run, axis=1),
        windows,
        energy.max(axis=1),
    )
