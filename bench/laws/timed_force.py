"""External force in windows of time: somebody leans on the rig, a valve opens, a crane passes.

``F`` is positive where it pushes towards positive displacement, so that the law, which is what the structure loses, is ``-F w(t)``:

    w(t) = sum_i r_i [S((t - s_i)/h) - S((t - s_i - d_i)/h)],  S(x) = (1 + x)^2/2 for -1 < x < 0, 1 - (1 - x)^2/2 for 0 < x < 1

Window i begins at ``s_i``, lasts ``d_i`` and has the relative size ``r_i``. Its edges rise smoothly from h before to h after, a step or so:
an integrator of fixed step then sees an edge move as it moves, and the response is a smooth function of it.

Time is the clock of the record. `constant_force` is the same without windows, `time_varying_friction` a limit that changes
with time, not a force.

References:
    M. Basseville & I. V. Nikiforov, Detection of Abrupt Changes, Prentice Hall 1993, ch. 2 (additive changes as steps).
"""

from __future__ import annotations

import math
from functools import lru_cache

from bench.errors import ParameterError
from bench.laws.base import ForceLaw, Parameter, kernel

MAX_WINDOWS = 64
"""Most windows of a force."""


@kernel
def force(t, q, v, z, theta, f):
    """``-F w(t)``."""
    n = int(theta[0])
    h = theta[2]
    for i in range(n):
        start = theta[3 + 3 * i]
        stop = start + theta[4 + 3 * i]
        if start - h < t < stop + h:
            x = min(max((t - start) / h, -1.0), 1.0)
            up = 0.5 * (1.0 + x) ** 2 if x < 0.0 else 1.0 - 0.5 * (1.0 - x) ** 2
            x = min(max((t - stop) / h, -1.0), 1.0)
            down = 0.5 * (1.0 + x) ** 2 if x < 0.0 else 1.0 - 0.5 * (1.0 - x) ** 2
            f[0] -= theta[1] * theta[5 + 3 * i] * (up - down)


@lru_cache(maxsize=MAX_WINDOWS)
def timed_force_law(n_windows: int = 1) -> ForceLaw:
    """A force in `n_windows` windows of time.

    Args:
        n_windows: 1 to `MAX_WINDOWS`.

    Raises:
        ParameterError: `n_windows` is outside its range.
    """
    if not 1 <= n_windows <= MAX_WINDOWS:
        raise ParameterError(f"a timed force takes 1 to {MAX_WINDOWS} windows; {n_windows} came")
    windows = [
        (
            Parameter(f"start_{i + 1}", "s", 1.0 + 2.0 * i, (-math.inf, math.inf), "beginning of the window"),
            Parameter(f"duration_{i + 1}", "s", 1.0, (0.0, math.inf), "its length"),
            Parameter(f"relative_{i + 1}", "1", 1.0, (-math.inf, math.inf), "its force over F"),
        )
        for i in range(n_windows)
    ]
    return ForceLaw(
        name="timed_force",
        parameters=(
            Parameter("force", "N", 5.0, (-math.inf, math.inf), "force F in the windows", "N m"),
            Parameter("rise_time", "s", 1e-3, (1e-9, math.inf), "half the time h over which edges rise"),
            *(parameter for window in windows for parameter in window),
        ),
        force=force,
        equation="f = -F w(t), w the sum of the windows that are open",
        reference="Basseville & Nikiforov 1993, ch. 2",
        smoothness="smooth",
        header=(float(n_windows),),
    )


TIMED_FORCE = timed_force_law()
