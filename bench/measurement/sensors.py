"""A chain for each channel of a recording."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bench.errors import ParameterError, UnknownNameError
from bench.measurement.chain import Chain
from bench.signals.streams import named_streams

if TYPE_CHECKING:
    from bench.recording import Recording


def measure(
    recording: Recording,
    chains: Mapping[str, Chain],
    rng: np.random.Generator | None = None,
    *,
    cross_talk: Mapping[str, Mapping[str, float]] | None = None,
) -> Recording:
    """A recording as its sensors would have given it.

    Cross-talk comes first, in the transducers: each channel named gets a part of the true values of others. Then every
    channel passes its chain, with noise from a stream derived from its name, so that one more sensor changes nothing for
    the others. Channels without a chain stay as they are.

    Args:
        recording: The true values.
        chains: Chain by name of the channel.
        rng: Source of randomness; may be None where no chain draws.
        cross_talk: For a channel, the part of others it picks up, ``{"force_x": {"force_y": 0.02}}`` [unit of the channel
            per unit of the other].

    Returns:
        The recording with the measured channels in place of the true ones. Their `noise_std` is that of the chain together
        with what the channel had before (None where both are nothing), a role not said becomes "measured", and
        ``meta["measurement"]`` lists the chains by channel.

    Raises:
        UnknownNameError: A channel named is not in the recording.
        ParameterError: A chain does not fit the sample rate, needs `rng`, or is no `Chain`; a part is not finite.
    """
    parts = {} if cross_talk is None else cross_talk
    for name in [*chains, *parts, *(other for row in parts.values() for other in row)]:
        if name not in recording.names:
            raise UnknownNameError("channel", name, recording.names)
    true = {name: _picked_up(recording, name, parts.get(name, {})) for name in {**parts, **chains}}
    streams = dict.fromkeys(chains) if rng is None else named_streams(rng, chains)
    measured, noise = dict(true), {}
    history = {name: list(stages) for name, stages in recording.meta.get("measurement", {}).items()}
    for name, chain in chains.items():
        if not isinstance(chain, Chain):
            raise ParameterError(
                f"channel '{name}' is measured by {chain!r}; a Chain is expected, as Chain(Noise(0.1))"
            )
        try:
            measured[name] = chain.apply(true[name], recording.sample_rate, streams[name])
        except ParameterError as error:
            raise ParameterError(f"channel '{name}': {error}") from error
        std = float(np.hypot(chain.gain * (recording.channel(name).noise_std or 0.0), chain.noise_std))
        if std > 0.0:
            noise[name] = std
        history.setdefault(name, []).append(chain.to_dict())
    roles = {name: recording.channel(name).role or "measured" for name in measured}
    result = recording.with_channels(measured, roles=roles, noise_std=noise)
    return result.with_(meta={"measurement": history}) if history else result


def _picked_up(recording: Recording, name: str, row: Mapping[str, float]) -> NDArray[np.float64]:
    """The channel's own values and its parts of others ``(n,)``."""
    x = np.array(recording[name])
    for other, part in row.items():
        if isinstance(part, bool | str) or not np.isfinite(part):
            raise ParameterError(
                f"the cross-talk of '{other}' into '{name}' is {part!r}; a finite number is expected"
            )
        x += part * recording[other]
    return x
