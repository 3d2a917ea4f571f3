"""Independent random streams by name, so that adding one does not change the others."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from bench.errors import ParameterError


def named_streams(rng: np.random.Generator, names: Iterable[str]) -> dict[str, np.random.Generator]:
    """Draw one generator for each name from a parent.

    The parent is advanced by the same amount whatever the names, and the stream of a name depends on the
    parent's state and on that name alone. (`Generator.spawn` numbers its children instead: there a channel
    inserted in front would shift all others.)

    Args:
        rng: The parent generator.
        names: Names of the streams, each once.

    Returns:
        A generator by name, in the order of `names`.

    Raises:
        ParameterError: `rng` is no `numpy.random.Generator`.
    """
    if not isinstance(rng, np.random.Generator):
        raise ParameterError(
            f"rng must be a numpy.random.Generator, as from np.random.default_rng(seed); {rng!r} came"
        )
    entropy = [int(word) for word in rng.integers(0, 2**32, size=4, dtype=np.uint64)]
    return {
        name: np.random.default_rng(np.random.SeedSequence(entropy, spawn_key=tuple(name.encode())))
        for name in names
    }
