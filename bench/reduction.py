"""The reduced-order joint: an identified model takes the true joint's place, and the two systems are compared.

Identification sees what a laboratory sees: `joint_data` (in `bench.identification.restoring_force`) recovers the joint's
restoring forces from loads, accelerations and the known mounts; `reduced_joint` turns them into an `Element` that any rig can
hold, and `compare` drives the true and the reduced rig alike.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from typing import Any, Literal, NamedTuple

import numpy as np

from bench.errors import IdentificationError, UnknownNameError
from bench.identification.memory import MemoryModel, fit_memory
from bench.identification.network import NetworkModel, fit_network
from bench.identification.polynomial import PolynomialModel, fit_polynomial
from bench.identification.restoring_force import JointData
from bench.recording import Recording, nmse
from bench.rig import Drive, Element, Rig, simulate


class Comparison(NamedTuple):
    """Two rigs under the same drive."""

    true: Recording
    reduced: Recording
    nmse: dict[str, float]  # [%] by channel, settling time left out; only channels that move


def element_from(
    model: PolynomialModel | NetworkModel | MemoryModel, joints: Sequence[str], *, name: str = "joint"
) -> Element:
    """The reduced-order joint of an identified model, ready to be put into a rig."""
    return Element(model.law, tuple(joints), model.theta, name=name, validity=model.range)


def reduced_joint(
    data: JointData,
    joints: Sequence[str],
    *,
    model: Literal["polynomial", "network", "memory"] = "network",
    name: str = "joint",
    rng: np.random.Generator | None = None,
    **settings: object,
) -> Element:
    """Identify a reduced-order joint and return it as an element.

    Args:
        data: States and restoring forces, of all training records together.
        joints: Joints or fixed tendons that the element will act on, in the order of the data's columns.
        model: "polynomial" (settings as of `fit_polynomial`), "network" (as of `fit_network`) or "memory" (as of `fit_memory`).
        name: Name of the element; the true one's, so that channels of both rigs compare.
        rng: Source of the network's random starts.
        **settings: Passed on.

    Raises:
        UnknownNameError: `model` is none of these.
        IdentificationError: The data do not determine the model.
    """
    if model == "polynomial":
        return element_from(fit_polynomial(data.states, data.forces, **settings), joints, name=name)  # type: ignore[arg-type]
    if model == "network":
        generator = rng if rng is not None else np.random.default_rng(0)
        fitted = fit_network(data.states, data.forces, rng=generator, **settings)  # type: ignore[arg-type]
        return element_from(fitted, joints, name=name)
    if model == "memory":
        if data.time is None:
            raise IdentificationError(
                "a joint with memory needs the times of its data; `joint_data` gives them"
            )
        remembered = fit_memory(data.states, data.forces, time=data.time, **settings)  # type: ignore[arg-type]
        return element_from(remembered, joints, name=name)
    raise UnknownNameError("reduced-order model", model, ("polynomial", "network", "memory"))


def compare(
    true: Rig,
    reduced: Rig,
    drive: Drive,
    *,
    seed: int = 0,
    initial: Mapping[str, tuple[float, float]] | None = None,
    sample_rate: float | None = None,
    settle: float = 0.0,
) -> Comparison:
    """Drive two rigs alike and compare every channel that both have.

    Args:
        true: The rig with the true joint.
        reduced: The same rig with the reduced-order joint under the same element name.
        drive: The excitation; both rigs get the same samples.
        seed: Seed of the excitation.
        initial: Initial motion by joint.
        sample_rate: Rate of the records [Hz].
        settle: Seconds left out of the scores.

    Returns:
        Both records and the NMSE [%] by channel.
    """
    records = [
        simulate(
            rig,
            drive,
            rng=np.random.default_rng(seed),
            initial=initial,
            sample_rate=sample_rate,
            settle=settle,
        )
        for rig in (true, reduced)
    ]
    return Comparison(records[0], records[1], channel_nmse(records[0], records[1]))


def channel_nmse(measured: Recording, simulated: Recording) -> dict[str, float]:
    """NMSE [%] of every channel that both records hold and that moves in the measured one, commands left out."""
    scored = measured.scored
    return {
        channel.name: nmse(measured[channel.name][scored], simulated[channel.name][scored])
        for channel in measured.channels
        if channel.role != "command"
        and channel.name in simulated.names
        and np.ptp(measured[channel.name][scored]) > 0.0
    }


def __getattr__(name: str) -> Any:
    if name != "reduce":
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
    warnings.warn(
        "bench.reduce is called bench.reduced_joint now; the old name goes with the next version",
        DeprecationWarning,
        stacklevel=3,  # past `bench`, by which the name is asked for
    )
    return reduced_joint
