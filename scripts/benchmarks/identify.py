"""Identification against the tools people would otherwise take: torch, scikit-learn, mujoco.sysid, and the bare disk.

Every comparison is to equal error: the error wanted is fixed, each side runs until it has it, and what it reached stands
in the row's detail. A peer that does not get there within its time cap counts with the cap, and the row's name says so: the
ratio is then a lower bound.
"""

from __future__ import annotations

import os
import tempfile
import time
import warnings
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from bench import joint_rig, simulate, write_recording
from bench.arrays import Array
from bench.demo.joint import laboratory_view, training_records
from bench.identification.network import fit_network
from bench.identification.polynomial import fit_polynomial
from benchmarks.identify_parameters import output_error
from benchmarks.timing import Row, interleave, ratio_row

THIN = 30
"""Every so many samples of the joint's three records are trained on: a training then takes a fraction of a second."""
N_HIDDEN = 15
TARGET = 3.0
"""Normalised mean-square error that every training goes on to [%]; at 2 % scikit-learn and Adam do not arrive."""
CAP = 10.0
"""Seconds after which a peer's training ends."""
SEED = 2


class _Training:
    """The joint's data, scaled to ±1 as every side takes them."""

    def __init__(self) -> None:
        data = laboratory_view(training_records(), joint_rig())
        self.states, self.forces = data.states[::THIN], data.forces[::THIN]
        self.inputs, self.outputs = (_scaled(part) for part in (self.states, self.forces))
        self.spread = float(np.sum(np.var(self.outputs, axis=0)))
        self.reached: dict[str, float] = {}

    def percent(self, estimated: Array) -> float:
        """Normalised mean-square error [%]."""
        return 100.0 * float(np.sum(np.mean((estimated - self.outputs) ** 2, axis=0))) / self.spread

    def ours(self) -> None:
        """`fit_network`, one start, without prior, on all samples: the same problem as the peers'."""
        model = fit_network(
            self.states,
            self.forces,
            rng=np.random.default_rng(SEED),
            n_hidden=N_HIDDEN,
            n_restarts=1,
            n_stages=1,
            max_samples=None,
            max_iterations=1000,
            tolerance=TARGET,
            regularise=False,
            validation_fraction=0.0,
        )
        low, high = self.forces.min(axis=0), self.forces.max(axis=0)
        self.reached["ours"] = self.percent((2.0 * model.predict(self.states) - low - high) / (high - low))

    def torch(self, name: str) -> None:
        """Full-batch training by Adam (the quickest of its usual rates here) or L-BFGS with line search."""
        import torch

        torch.set_num_threads(1)  # of 1 and 2 the quicker one by far for matrices of this size
        torch.manual_seed(SEED)
        net = torch.nn.Sequential(
            torch.nn.Linear(4, N_HIDDEN), torch.nn.Tanh(), torch.nn.Linear(N_HIDDEN, 2)
        ).double()
        inputs, outputs = torch.from_numpy(self.inputs), torch.from_numpy(self.outputs)

        def loss() -> Any:
            return ((net(inputs) - outputs) ** 2).mean(0).sum() * (100.0 / self.spread)

        def closure() -> Any:
            optimiser.zero_grad()
            value = loss()
            value.backward()
            return value

        optimiser: Any = (
            torch.optim.Adam(net.parameters(), lr=1e-2)
            if name == "Adam"
            else torch.optim.LBFGS(
                net.parameters(),
                max_iter=20,
                history_size=50,
                line_search_fn="strong_wolfe",
                tolerance_grad=1e-14,
                tolerance_change=1e-16,
            )
        )
        begun = time.perf_counter()
        while True:
            value = float(optimiser.step(closure).detach())  # of before the step: at worst one step too many
            if value <= TARGET or time.perf_counter() - begun > CAP:
                break
        self.reached[f"torch {name}"] = value

    def scikit_learn(self, iterations: int) -> float:
        """scikit-learn's L-BFGS, told how many iterations it will need."""
        from sklearn.neural_network import MLPRegressor

        model = MLPRegressor(
            hidden_layer_sizes=(N_HIDDEN,),
            activation="tanh",
            solver="lbfgs",
            alpha=0.0,
            max_iter=iterations,
            max_fun=10**9,
            tol=1e-12,
            random_state=SEED,
        )
        with threadpool_limits(1), warnings.catch_warnings():
            warnings.simplefilter("ignore")  # that it has not converged is the point of max_iter
            model.fit(self.inputs, self.outputs)
            self.reached["scikit-learn"] = self.percent(np.asarray(model.predict(self.inputs)))
        return self.reached["scikit-learn"]

    def iterations_of_scikit_learn(self) -> int:
        """Fewest iterations, to a tenth, that reach the target; those that fill the cap where none does."""
        low, high = 100, 200
        while True:
            begun = time.perf_counter()
            if self.scikit_learn(high) <= TARGET:
                break
            if time.perf_counter() - begun > CAP / 2.0 or high > 100_000:
                return high
            low, high = high, 2 * high
        while high > 1.1 * low:
            middle = (low + high) // 2
            low, high = (low, middle) if self.scikit_learn(middle) <= TARGET else (middle, high)
        return high


def _scaled(columns: Array) -> Array:
    low, high = columns.min(axis=0), columns.max(axis=0)
    return np.ascontiguousarray((2.0 * columns - low - high) / (high - low))


def _networks(repeats: int) -> list[Row]:
    training = _Training()
    iterations = training.iterations_of_scikit_learn()
    peers: dict[str, Callable[[], Any]] = {
        "torch Adam": partial(training.torch, "Adam"),
        "torch L-BFGS": partial(training.torch, "L-BFGS"),
        "scikit-learn": partial(training.scikit_learn, iterations),
    }
    seconds = interleave({"ours": training.ours, **peers}, max(3, repeats // 5))
    rows = []
    for name in peers:
        short = training.reached[name] > TARGET
        rows.append(
            ratio_row(
                f"network training against {name}{' (never there: lower bound)' if short else ''}",
                seconds["ours"],
                seconds[name],
                limit="≥ 1",
                meaning=f"peer's seconds to an NMSE of {TARGET:g} % / ours, {N_HIDDEN} tanh units, "
                f"{len(training.states)} samples",
                detail={"our_nmse": training.reached["ours"], "peer_nmse": training.reached[name]},
            )
        )
    return rows


def _polynomials(repeats: int) -> list[Row]:
    """The same 35 terms on both sides: total degree 3 in four states."""
    from sklearn.linear_model import LinearRegression
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import MinMaxScaler, PolynomialFeatures

    data = laboratory_view(training_records(), joint_rig())
    reached: dict[str, float] = {}

    def ours() -> None:
        model = fit_polynomial(data.states, data.forces, orders=3, kind="total")
        reached["our_nmse"] = float(np.mean(model.report.nmse))

    def peer() -> None:
        model = make_pipeline(
            MinMaxScaler((-1, 1)), PolynomialFeatures(3, include_bias=False), LinearRegression()
        )
        with threadpool_limits(1):
            estimated = model.fit(data.states, data.forces).predict(data.states)
        spread = np.var(data.forces, axis=0)
        reached["peer_nmse"] = float(
            100.0 * np.mean(np.mean((estimated - data.forces) ** 2, axis=0) / spread)
        )

    seconds = interleave({"ours": ours, "peer": peer}, repeats)
    if not np.isclose(reached["our_nmse"], reached["peer_nmse"], rtol=1e-6):
        raise RuntimeError(f"the polynomial fits do not agree: {reached}")
    return [
        ratio_row(
            "polynomial fit against scikit-learn",
            seconds["ours"],
            seconds["peer"],
            limit="≥ 1",
            meaning=f"seconds of PolynomialFeatures + LinearRegression, error included / ours, {len(data.states)} samples",
            detail=reached,
        )
    ]


def _disk(repeats: int) -> list[Row]:
    rng = np.random.default_rng(5)
    rig = joint_rig()
    drive = {"force": 4e3 * rng.standard_normal(30_000), "torque": 1e2 * rng.standard_normal(30_000)}
    recording = simulate(rig, drive)
    with tempfile.TemporaryDirectory(dir=os.environ.get("TMPDIR")) as folder:
        ours, peer = Path(folder) / "record.parquet", Path(folder) / "record.npy"
        table = np.column_stack([recording.time, recording.values])

        def raw() -> None:
            with peer.open("wb") as file:
                np.save(file, table)
                file.flush()
                os.fsync(file.fileno())

        seconds = interleave({"ours": lambda: write_recording(ours, recording), "peer": raw}, repeats)
        sizes = {"our_bytes": ours.stat().st_size, "peer_bytes": peer.stat().st_size}
    return [
        ratio_row(
            "Parquet writing of a recording against raw disk",
            seconds["ours"],
            seconds["peer"],
            meaning="seconds of np.save and fsync of the same numbers / ours, compressed and checked",
            detail=sizes,
        )
    ]


def rows(repeats: int = 15) -> list[Row]:
    """Rows of the group."""
    return [*_networks(repeats), *_polynomials(repeats), *_disk(repeats), *output_error(repeats)]
