"""What a policy keeps of the record so far: a long short-term memory, as plain arrays."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit

from bench.errors import ParameterError


@dataclass(eq=False)
class PolicyMemory:
    """What a policy remembers of the records of m tests, brought up to date by `Policy.act`.

    Attributes:
        hidden: What the cell shows ``(m, n_units)``; of no width where the policy has no memory.
        cell: What it keeps ``(m, n_units)``.
    """

    hidden: NDArray[np.float32]
    cell: NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class Recurrence:
    """A long short-term memory: what a policy keeps of a record from window to window.

    With the last observation x and what the cell showed before, h, the gates are (i, f, g, o) = W x + R h + b; the cell keeps
    c ← σ(f) c + σ(i) tanh(g) and shows h = σ(o) tanh(c), σ the logistic function.

    Attributes:
        input: Weights of the observations W ``(4 n_units, n_observations)``, rows by gate, in the order above.
        hidden: Weights of what it showed R ``(4 n_units, n_units)``.
        bias: Offsets b ``(4 n_units,)``.

    References:
        Hochreiter, Schmidhuber 1997, Neural Computation 9(8); the forget gate: Gers, Schmidhuber, Cummins 2000, Neural Computation 12(10).
    """

    input: NDArray[np.float32] = field(repr=False)
    hidden: NDArray[np.float32] = field(repr=False)
    bias: NDArray[np.float32] = field(repr=False)

    def __post_init__(self) -> None:
        for name in ("input", "hidden", "bias"):
            object.__setattr__(self, name, frozen(getattr(self, name)))
        n = self.n_units
        rows = 4 * n
        if self.input.ndim != 2 or (self.input.shape[0], self.hidden.shape, self.bias.shape) != (
            rows,
            (rows, n),
            (rows,),
        ):
            raise ParameterError(
                f"a memory has weights {self.input.shape} of its input, {self.hidden.shape} of what it showed, and offsets "
                f"{self.bias.shape}; (4 n, n_observations), (4 n, n) and (4 n,) are expected"
            )

    @property
    def n_units(self) -> int:
        """Numbers it keeps."""
        return self.hidden.shape[-1] if self.hidden.ndim else 0

    def __call__(self, value: NDArray[np.float32], memory: PolicyMemory) -> NDArray[np.float32]:
        """What it shows ``(m, n_units)`` after the observations ``(m, n_observations)``; `memory` is brought up to date."""
        gates = value @ self.input.T + memory.hidden @ self.hidden.T + self.bias
        let_in, kept, new, shown = np.split(gates, 4, axis=-1)
        memory.cell = expit(kept) * memory.cell + expit(let_in) * np.tanh(new)
        memory.hidden = expit(shown) * np.tanh(memory.cell)
        return memory.hidden


def frozen(array: NDArray) -> NDArray[np.float32]:
    """A copy in single precision that cannot be written to.

    Raises:
        ParameterError: It holds no numbers.
    """
    if np.asarray(array).dtype.kind not in "fiu":
        raise ParameterError(f"an array of a policy holds {np.asarray(array).dtype}; numbers are expected")
    with np.errstate(over="ignore"):  # infinity is refused with the name of its array
        result = np.array(array, dtype=np.float32)
    result.flags.writeable = False
    return result
