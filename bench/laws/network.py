"""Feed-forward network force law on any number of joints: one tanh hidden layer, linear output, physical units.

The reduced-order joint of the dissertation's section 4.1.4 (4–l–2 there). The normalisation used in training is folded
into the weights (appendix A), so that the law reads metres and gives newtons, and so that it can be written as a deck
of scalar equations (section 5.1.2). Outside the training range it saturates, or falls, as its weights happen to have it.

A *bounded* network takes the states at the nearest point of the box of its data and adds ``k (q - q_box) + c (v - v_box)`` with
k, c >= 0 along each coordinate, as a bounded polynomial does: whatever the weights, its force then leads back into the box.
"""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from importlib import resources
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bench.errors import ParameterError
from bench.laws.base import MAX_COORDINATES, ForceLaw, Parameter, kernel
from bench.laws.coupling import INCH, POUND_FORCE
from bench.laws.polynomial import beyond_parameters


@kernel
def force(t, q, v, z, theta, f):
    """``f = W2 tanh(W1 s + b1) + b2`` with ``s = (q, v)``, of a bounded network within its box and with what lies beyond added."""
    bounded = theta[0] < 0.0
    n = int(abs(theta[0]))
    width = int(theta[1])
    w1 = 2 + 4 * n if bounded else 2
    b1 = w1 + 2 * n * width
    w2 = b1 + width
    b2 = w2 + n * width
    for o in range(n):
        f[o] += theta[b2 + o]
    for j in range(width):
        row = w1 + 2 * n * j
        s = theta[b1 + j]
        if bounded:
            for i in range(n):
                s += theta[row + i] * min(max(q[i], theta[2 + i]), theta[2 + 2 * n + i])
                s += theta[row + n + i] * min(max(v[i], theta[2 + n + i]), theta[2 + 3 * n + i])
        else:
            for i in range(n):
                s += theta[row + i] * q[i] + theta[row + n + i] * v[i]
        # tanh by one exponential, twice as quick as the library's; beyond 20 it is ±1 to the last bit, and exp is kept
        # from overflowing. Near zero its absolute error stays at 1e-16, which is what a sum of neurons needs.
        s = min(max(s, -20.0), 20.0)
        hidden = 1.0 - 2.0 / (math.exp(2.0 * s) + 1.0)
        for o in range(n):
            f[o] += theta[w2 + o * width + j] * hidden
    if bounded:
        for i in range(n):
            f[i] += theta[b2 + n + i] * (q[i] - min(max(q[i], theta[2 + i]), theta[2 + 2 * n + i]))
            f[i] += theta[b2 + 2 * n + i] * (v[i] - min(max(v[i], theta[2 + n + i]), theta[2 + 3 * n + i]))


class NetworkWeights(NamedTuple):
    """Weights of a network with one hidden layer, in one system of units."""

    W1: NDArray[np.float64]
    """Input weights, shape (n_hidden, n_inputs)."""
    b1: NDArray[np.float64]
    """Hidden biases, shape (n_hidden,)."""
    W2: NDArray[np.float64]
    """Output weights, shape (n_outputs, n_hidden)."""
    b2: NDArray[np.float64]
    """Output biases, shape (n_outputs,)."""

    def __call__(self, inputs: ArrayLike) -> NDArray[np.float64]:
        """Outputs (n, n_outputs) for inputs (n, n_inputs)."""
        return np.tanh(np.asarray(inputs, dtype=float) @ self.W1.T + self.b1) @ self.W2.T + self.b2

    def flat(self) -> NDArray[np.float64]:
        """All weights in the order of a network law's parameters."""
        return np.concatenate([part.ravel() for part in self])


def fold_scaling(
    weights: NetworkWeights,
    input_centre: ArrayLike,
    input_scale: ArrayLike,
    *,
    output_centre: ArrayLike = 0.0,
    output_scale: ArrayLike = 1.0,
) -> NetworkWeights:
    """Weights that act on physical inputs and give physical outputs, from weights trained on normalised ones.

    Args:
        weights: A network for inputs ``(s - input_centre) / input_scale`` and outputs ``(f - output_centre) / output_scale``.
        input_centre: Centre of each input (n_inputs,) or one number.
        input_scale: Half-range of each input (n_inputs,) or one number.
        output_centre: Centre of each output (n_outputs,) or one number.
        output_scale: Half-range of each output (n_outputs,) or one number.

    Returns:
        The network for ``s`` and ``f`` themselves; the same function, exactly.

    References:
        Tasbihgoo 2006, eqs. A.10 and A.12 (A.12 prints a_1n where a_2n is meant).
    """
    W1 = weights.W1 / np.asarray(input_scale, dtype=float)
    scale = np.broadcast_to(np.asarray(output_scale, dtype=float), weights.b2.shape)
    b1 = weights.b1 - W1 @ np.broadcast_to(np.asarray(input_centre, dtype=float), (W1.shape[1],))
    return NetworkWeights(
        W1, b1, weights.W2 * scale[:, None], weights.b2 * scale + np.asarray(output_centre, dtype=float)
    )


def network_law(
    n_joints: int = 2, n_hidden: int = 30, *, box: tuple[ArrayLike, ArrayLike] | None = None
) -> ForceLaw:
    """Build the network law of one size; weights and biases are its parameters.

    Args:
        n_joints: Number of joints; the inputs are their displacements, then their velocities.
        n_hidden: Number of tanh units.
        box: Smallest and largest value of each state (2 n_joints,) [m, rad, m/s, rad/s] of a bounded network; None for one that
            is its weights everywhere.

    Returns:
        A law on `n_joints` coordinates with parameters W1, b1, W2, b2 row by row, in SI units, and of a bounded one the stiffness,
        then the damping, of each coordinate beyond the box. The defaults make it a spring and damper that saturate.

    Raises:
        ParameterError: `n_joints` or `n_hidden` is out of range, or the box is none.

    References:
        Tasbihgoo 2006, eqs. 4.14, 4.15, A.13, A.14.
    """
    if not 1 <= n_joints <= MAX_COORDINATES:
        raise ParameterError(
            f"a network on {n_joints} joints was asked for; 1 to {MAX_COORDINATES} are possible"
        )
    if n_hidden < 1:
        raise ParameterError(f"a network with {n_hidden} hidden units was asked for; at least 1 is expected")
    n, states = n_joints, 2 * n_joints
    parameters = []
    for j in range(n_hidden):
        for i in range(states):
            unit, rotational = ("1/m", "1/rad") if i < n else ("s/m", "s/rad")
            name = f"W1[{j + 1},{i + 1}]"
            parameters.append(Parameter(name, unit, float(j % states == i), rotational=rotational))
    parameters += [Parameter(f"b1[{j + 1}]", "1", 0.0) for j in range(n_hidden)]
    for o in range(n):
        for j in range(n_hidden):
            default = {o: 1000.0, n + o: 1.0}.get(j % states, 0.0)
            parameters.append(Parameter(f"W2[{o + 1},{j + 1}]", "N", default, rotational="N m"))
    parameters += [Parameter(f"b2[{o + 1}]", "N", 0.0, rotational="N m") for o in range(n)]
    header = [float(n), float(n_hidden)]
    if box is not None:
        low, high = (np.asarray(end, dtype=float) for end in box)
        if (
            low.shape != (states,)
            or high.shape != (states,)
            or not np.all(low <= high)
            or not np.all(np.isfinite([low, high]))
        ):
            raise ParameterError(
                f"a box from {low} to {high} came; {states} finite values of the states each, none falling, are expected"
            )
        header = [-float(n), float(n_hidden), *low.tolist(), *high.tolist()]
        parameters += beyond_parameters(n)
    return ForceLaw(
        name="network",
        parameters=tuple(parameters),
        force=force,
        equation="f = W2 tanh(W1 s + b1) + b2, s = (q, v)",
        reference="Tasbihgoo 2006, eqs. 4.14, 4.15, A.13, A.14",
        n_coordinates=n,
        header=tuple(header),
    )


def network_law_of(header: Sequence[float]) -> ForceLaw:
    """The network law that has this header.

    Raises:
        ParameterError: No network law has it.
    """
    box = tuple(header[2:])
    if len(header) < 2 or any(entry != int(entry) for entry in header[:2]):
        raise ParameterError(f"a network's header begins with joints and hidden units; {tuple(header)} came")
    n, width = int(header[0]), int(header[1])
    if len(box) != (4 * -n if n < 0 else 0):
        raise ParameterError(
            f"a network's header is (joints, hidden units), of a bounded one (-joints, hidden units, box); {tuple(header)} came"
        )
    return network_law(abs(n), width, box=(box[: -2 * n], box[-2 * n :]) if box else None)


class PublishedNetwork(NamedTuple):
    """A law and its parameters."""

    law: ForceLaw
    theta: NDArray[np.float64]
    """Header and weights in SI units."""


def published_network() -> PublishedNetwork:
    """The 30-neuron network printed in the dissertation's Nastran deck, converted from inch and pound-force to SI.

    Its inputs are the relative displacement, rotation and their rates (second body less first) and its outputs the
    restoring forces, positive when they oppose positive displacement: the deck applies minus these to the second body.

    Returns:
        The law on two joints (axial [m], torsional [rad]) and its theta (outputs [N] and [N m]).

    References:
        Tasbihgoo 2006, appendix B.3, file NEURALCP.DAT.
    """
    text = resources.files("bench").joinpath("_data", "published_network.json").read_text(encoding="utf-8")
    deck = json.loads(text)
    printed = NetworkWeights(*(np.array(deck[name], dtype=float) for name in NetworkWeights._fields))
    weights = fold_scaling(
        printed, 0.0, [INCH, 1.0, INCH, 1.0], output_scale=[POUND_FORCE, POUND_FORCE * INCH]
    )
    law = network_law(2, len(weights.b1))
    return PublishedNetwork(law, law.theta(weights.flat()))
