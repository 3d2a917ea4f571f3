"""What a joint with memory is compared with: memoryless models, Bouc-Wen, NARX and, where torch is installed, an LSTM.

NARX and LSTM say the next force from past ones at the records' own rate. They are no force laws in continuous time, so nothing but
their force along the *true* unseen motion is scored, which is easier than the closed loop that the others are scored in.
"""

from __future__ import annotations

import time as clock
from itertools import combinations_with_replacement
from typing import Any

import numpy as np

from bench.arrays import Array
from bench.identification.memory import runs
from bench.identification.parametric import ComponentRecord, fit_law
from bench.laws.bouc_wen_variants import GENERALISED_BOUC_WEN
from bench.rig import Element


def bouc_wen(states: Array, forces: Array, time: Array, joints: tuple[str, ...]) -> tuple[Element, ...]:
    """One generalised Bouc-Wen law a coordinate (k, c, d and one power: five parameters), fitted to every third record sample."""
    k = forces.shape[1]
    found = []
    for i, joint in enumerate(joints):
        motions = []
        for a, b in runs(time):
            part = slice(a, b, 3)
            if np.ptp(states[a:b, i]) > 0.0:
                columns = (states[part, i, None], states[part, k + i, None], forces[part, i, None])
                motions.append(ComponentRecord(time[part], *columns))
        q, v, f = (np.concatenate([m[j] for m in motions]).ravel() for j in (1, 2, 3))
        stiffness, damping = np.linalg.lstsq(np.stack([q, v], 1), f, rcond=None)[0]
        span = float(np.max(np.abs(q)))
        start = {
            "k": 2.0 * abs(stiffness), "c": max(abs(damping), 1e-9), "d": 0.1 * abs(stiffness) / span**2,
            "beta_1": 0.5 / span, "gamma_1": 0.5 / span,
        }  # fmt: skip
        law = GENERALISED_BOUC_WEN
        start["beta_2"] = start["gamma_2"] = 0.0
        model = fit_law(law, motions, start=start, fixed=("beta_2", "gamma_2"), starts=1)
        found.append(Element(law, (joint,), model.theta, name=f"joint_{joint}"))
    return tuple(found)


def _narx_features(inputs: Array, previous: Array, past: Array) -> Array:
    """Products up to the second degree of states, the states before and the forces before (n, n_features)."""
    x = np.hstack([inputs, previous, past])
    pairs = [x[:, i] * x[:, j] for i, j in combinations_with_replacement(range(x.shape[1]), 2)]
    return np.column_stack([np.ones(len(x)), x, *pairs])


def narx(states: Array, forces: Array, time: Array, unseen: Array, unseen_time: Array) -> tuple[Array, int]:
    """Forces along an unseen motion by a polynomial NARX of degree 2, run freely, and its number of coefficients."""
    scale, level = np.std(states, axis=0) + 1e-300, np.std(forces, axis=0) + 1e-300
    s, f, u = states / scale, forces / level, unseen / scale
    later = np.concatenate([np.arange(a + 1, b) for a, b in runs(time)])
    matrix = _narx_features(s[later], s[later - 1, : forces.shape[1]], f[later - 1])
    gram = matrix.T @ matrix
    gram[np.diag_indices_from(gram)] *= 1.0 + 1e-8
    coefficients = np.linalg.solve(gram, matrix.T @ f[later])
    out = np.zeros((len(u), forces.shape[1]))
    bound = 10.0 * np.max(np.abs(f), axis=0)
    for a, b in runs(unseen_time):
        for i in range(a + 1, b):
            row = _narx_features(u[i : i + 1], u[i - 1 : i, : forces.shape[1]], out[i - 1 : i])
            out[i] = np.clip(row[0] @ coefficients, -bound, bound)
    return out * level, coefficients.size


def lstm(
    states: Array,
    forces: Array,
    time: Array,
    unseen: Array,
    unseen_time: Array,
    *,
    size: int,
    seconds: float = 60.0,
) -> tuple[Array, int] | None:
    """Forces along an unseen motion by an LSTM of about `size` weights, trained for so many seconds; None without torch."""
    try:
        import torch
    except ImportError:
        return None
    torch.manual_seed(0)
    torch.set_num_threads(2)
    scale, level = np.std(states, axis=0) + 1e-300, np.std(forces, axis=0) + 1e-300
    n, k = states.shape[1], forces.shape[1]
    hidden = next(h for h in range(1, 200) if 4 * h * (n + h + 2) + k * (h + n + 1) >= size)
    cell = torch.nn.LSTM(n, hidden, batch_first=True)
    head = torch.nn.Linear(hidden + n, k)
    parameters: list[Any] = [*cell.parameters(), *head.parameters()]
    optimiser = torch.optim.Adam(parameters, lr=1e-2)

    def respond(x: Any) -> Any:
        return head(torch.cat([cell(x)[0], x], dim=-1))

    x = torch.tensor(states / scale, dtype=torch.float32)
    y = torch.tensor(forces / level, dtype=torch.float32)
    length, warm = 300, 50
    starts = np.concatenate([np.arange(a, b - length) for a, b in runs(time)])
    rng, begun = np.random.default_rng(0), clock.monotonic()
    while clock.monotonic() - begun < seconds:
        chosen = rng.choice(starts, 32)
        windows = torch.stack([x[i : i + length] for i in chosen])
        wanted = torch.stack([y[i : i + length] for i in chosen])
        loss = torch.mean((respond(windows)[:, warm:] - wanted[:, warm:]) ** 2)
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
        share = (clock.monotonic() - begun) / seconds
        optimiser.param_groups[0]["lr"] = 1e-2 * (1.0 - 0.95 * min(share, 1.0))
    with torch.no_grad():
        found = [
            respond(torch.tensor(unseen[a:b] / scale, dtype=torch.float32)[None])[0].numpy()
            for a, b in runs(unseen_time)
        ]
    return np.vstack(found) * level, sum(p.numel() for p in parameters)
