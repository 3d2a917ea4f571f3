"""Campaigns: generation against bare stepping, cores against one, writing against the raw disk, the figures of docs/scale.md.

The group's rows come from `scripts/benchmark.py campaign`. The measured block of the document is written anew by
``PYTHONPATH=scripts python -m benchmarks.campaign docs/scale.md``; with ``--full`` the 10 000 records are all run.
"""

from __future__ import annotations

import dataclasses
import json
import os
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from bench.campaign import Plan, plan_from_dict, run_campaign
from bench.campaign.execution import cores, generator_of, payload_of
from bench.campaign.parts import part_name
from bench.campaign.store import Store
from bench.campaign.tables import part_contents
from bench.files import write_text
from benchmarks.new_process import in_new_process, memory_row
from benchmarks.timing import Row, interleave, ratio_row

TARGET_RECORDS = 10_000
TARGET_SECONDS = 900.0
SLICE = 64
"""Records of one timed run: long enough that opening a folder does not count, short enough for interleaved repeats."""

DOCUMENT: dict[str, Any] = {
    "name": "benchmark",
    "seed": 1,
    "records": SLICE,
    "duration": 10.0,
    "sample_rate": 1000.0,
    "records_per_part": 8,
    "channels": ["shaker", "displacement", "velocity", "acceleration_x", "carriage.gap/force"],
    "rigs": [
        {
            "rig": "sdof",
            "structure": {
                "mass": {"carriage": {"uniform": [1.5, 2.5]}},
                "stiffness": {"carriage": {"log_uniform": [800.0, 3000.0]}},
                "damping": {"carriage": {"uniform": [2.0, 8.0]}},
            },
            "elements": [
                {
                    "law": "gap",
                    "joints": ["carriage"],
                    "parameters": {"clearance": {"uniform": [0.001, 0.008]}},
                },
                {
                    "law": "bouc_wen",
                    "joints": ["carriage"],
                    "parameters": {"A": {"uniform": [300.0, 1500.0]}},
                },
            ],
        }
    ],
    "excitations": [
        {
            "signals": {
                "shaker": {"type": "band_limited_noise", "cutoff": 40.0, "rms": {"log_uniform": [3.0, 40.0]}}
            }
        }
    ],
    "sensors": [{"chains": {"displacement": [{"type": "noise", "std": 1e-5}]}}],
}
"""The target's plan: one degree of freedom, gap and Bouc-Wen, 10 s at 1 kHz, RK4."""


def _plan(**changes: Any) -> Plan:
    return dataclasses.replace(plan_from_dict(DOCUMENT), **changes)


def _campaign(plan: Plan, **settings: Any) -> dict[str, Any]:
    with tempfile.TemporaryDirectory() as folder:
        return run_campaign(plan, Path(folder) / "out", **settings).to_dict()


@contextmanager
def one_core() -> Iterator[None]:
    """Keep this thread, and those it starts, on one core."""
    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {min(before)})
    try:
        yield
    finally:
        os.sched_setaffinity(0, before)


def rows(repeats: int = 15) -> list[Row]:
    """Rows of the group; a run takes seconds, so a third of the repeats, but for the scaling, which the host disturbs most."""
    count = max(5, repeats // 3)
    return [
        *_stepping(count),
        _scaling(max(5, repeats // 2)),
        _target(),
        *_memory(),
        _writing(repeats),
        *_starting(count),
    ]


def _bare(plan: Plan, threads: int) -> None:
    """Step the plan's model without its laws as often as the campaign does."""
    from mujoco.batch import Batch

    from bench import native

    model = generator_of(payload_of(plan)).variants.full(0).rig.model
    native.uninstall()
    try:
        batch = Batch(model, plan.records, threads)
        batch.bind("qvel")[:] = 0.3
        batch.step(nstep=plan.n_samples)
    finally:
        native.install()


def _stepping(repeats: int) -> list[Row]:
    plan = _plan()
    seconds = interleave({"campaign": lambda: _campaign(plan), "bare": lambda: _bare(plan, cores())}, repeats)
    return [
        ratio_row(
            "campaign, SDOF gap + Bouc-Wen, against bare Batch.step",
            seconds["campaign"],
            seconds["bare"],
            limit="≥ 0.90",
            meaning="step rate with laws, draws, excitation, recording and writing, MuJoCo's clocks off / of the same model without laws",
            detail={"records": plan.records, "steps": plan.records * plan.n_samples, "threads": cores()},
        )
    ]


def _scaling(repeats: int) -> Row:
    """Beside the campaign the bare stepping, which tells how far this machine's cores are cores of their own.

    Twice the records in parts of half the size: at the end one core waits for the other's last part, of which a campaign has
    hundreds and this slice of one a few.
    """
    plan = _plan(records=2 * SLICE, records_per_part=4)

    def pinned(task: Callable[[], Any]) -> None:
        with one_core():
            task()

    seconds = interleave(
        {
            "all": lambda: _campaign(plan),
            "one": lambda: pinned(lambda: _campaign(plan)),
            "bare": lambda: _bare(plan, cores()),
            "bare, one": lambda: pinned(lambda: _bare(plan, 1)),
        },
        repeats,
    )
    ceiling = float(np.median(seconds["bare, one"] / seconds["bare"]))
    return ratio_row(
        f"campaign, {cores()} cores against 1",
        seconds["all"],
        seconds["one"],
        limit="≥ 1.8" if cores() == 2 else "",
        meaning=f"records a second on all cores / pinned to one; bare Batch.step on this machine: {ceiling:.3g}",
        detail={"bare_scaling": ceiling, "load_average": os.getloadavg()[0]},
    )


def _target() -> Row:
    """A process starts once, however many records it makes: two sizes tell the start from the rate."""
    few, many = _in_new_process(SLICE // 2), _in_new_process(SLICE * 2)
    whole = _whole_seconds(few, many)
    return Row(
        f"{TARGET_RECORDS} records of 10 s at 1 kHz, from {few['records']} and {many['records']}",
        whole / TARGET_SECONDS,
        (whole / TARGET_SECONDS, whole / TARGET_SECONDS),
        "≤ 1",
        "seconds the campaign takes, one start of the process and the records at the rate between both sizes / 900 s",
        {"whole_seconds": whole, **many},
    )


def _whole_seconds(few: dict[str, Any], many: dict[str, Any]) -> float:
    """Seconds of `TARGET_RECORDS` records by those of two smaller campaigns."""
    each = (many["seconds"] - few["seconds"]) / (many["records"] - few["records"])
    return many["seconds"] + each * (TARGET_RECORDS - many["records"])


def _memory() -> list[Row]:
    return [
        memory_row(f"{records} records in parts of 50", [_in_new_process(records, 50)["peak"]])
        for records in (SLICE, SLICE * 4)
    ]


def _in_new_process(records: int, part: int = 8) -> dict[str, Any]:
    """Run the target's plan in a process of its own; give its result, seconds and largest resident memory [bytes]."""
    code = (
        "import json, time; start = time.perf_counter(); from benchmarks.campaign import _campaign, _plan; "
        f"result = _campaign(_plan(records={records}, records_per_part={part})); "
        "result['seconds'] = time.perf_counter() - start; print(json.dumps(result))"
    )
    lines, peak = in_new_process(code)
    return json.loads(lines[-1]) | {"peak": peak}


def _writing(repeats: int) -> Row:
    plan = _plan()
    generator = generator_of(payload_of(plan))
    part = generator.part(0)
    with tempfile.TemporaryDirectory() as folder:
        store = Store(folder)
        for name in ("samples", "records", ".partial"):
            (store.folder / name).mkdir()

        def ours() -> None:
            store.write_part(plan, 0, [], part_contents(generator, part))

        def raw() -> None:
            with (store.folder / "raw").open("wb") as file:
                file.write(part.values.tobytes())
                file.flush()
                os.fsync(file.fileno())

        seconds = interleave({"parquet": ours, "raw": raw}, repeats)
        size = (store.folder / "samples" / part_name(0)).stat().st_size
    return ratio_row(
        "Parquet part against the raw array, both flushed to the disk",
        seconds["parquet"],
        seconds["raw"],
        meaning="seconds to write the channels' bytes / to encode, hash and write the part",
        detail={"raw_bytes": part.values.nbytes, "parquet_bytes": size},
    )


def _starting(repeats: int) -> list[Row]:
    first = (
        "import time; start = time.perf_counter(); import bench; imported = time.perf_counter() - start; "
        "import numpy as np; from bench import Element, sdof_rig, simulate; "
        "rig = sdof_rig(Element.of('gap', 'carriage'), Element.of('bouc_wen', 'carriage')); "
        "simulate(rig, {'shaker': np.ones(100)}); print(imported, time.perf_counter() - start)"
    )
    in_new_process(first)  # fills numba's cache, as a second use of the bench finds it
    taken = np.array(
        [[float(number) for number in in_new_process(first)[0][-1].split()] for _ in range(repeats)]
    )
    made = []
    for column, (name, limit) in enumerate(
        (("import bench", "≤ 1"), ("first native simulation of a process", "≤ 3"))
    ):
        low, high = np.percentile(taken[:, column], [10, 90])
        made.append(
            Row(name, float(np.median(taken[:, column])), (float(low), float(high)), limit, "seconds", {})
        )
    return made


def _cluster_rates() -> dict[int, float]:
    """Records a second on local dask clusters of one worker process a core, the clusters' start left out."""
    from distributed import LocalCluster

    rates = {}
    for workers in sorted({1, cores()}):
        settings = {"threads_per_worker": 1, "processes": True, "dashboard_address": None}
        with LocalCluster(n_workers=workers, **settings) as cluster:
            address = cluster.scheduler_address
            _campaign(_plan(records=8 * workers, records_per_part=1), scheduler=address)  # imports
            rates[workers] = _campaign(_plan(records=2 * SLICE), scheduler=address)["rate"]
    return rates


def measured(*, full: bool) -> str:
    """The measured block of docs/scale.md."""
    with one_core():
        single = _campaign(_plan())["rate"]
    rates = {1: single} | {
        n: _campaign(_plan(records=2 * SLICE), threads=n)["rate"] for n in range(2, cores() + 1)
    }
    clusters = _cluster_rates()
    target = _in_new_process(TARGET_RECORDS if full else 2 * SLICE, 50 if full else 8)
    result = _campaign(_plan(records=2 * SLICE, records_per_part=50))
    size = result["size"] / result["records"]
    core_seconds = 1.0 / single
    lines = ["| how | records/s | against one core |", "|---|---|---|"]
    lines += [f"| {n} core{'s' * (n > 1)}, threads | {r:.1f} | {r / single:.2f} |" for n, r in rates.items()]
    lines += [
        f"| {n} dask worker process{'es' * (n > 1)} | {r:.1f} | {r / single:.2f} |"
        for n, r in clusters.items()
    ]
    seconds = target["seconds"] if full else _whole_seconds(_in_new_process(SLICE // 2), target)
    lines += [
        "",
        f"- One record (10 s at 1 kHz, RK4, gap and Bouc-Wen, five channels) takes {1e3 * core_seconds:.0f} ms of one core and "
        f"{size / 1e3:.0f} kB of disk.",
        f"- A million records: {core_seconds * 1e6 / 3600:.1f} core-hours and {size / 1e3:.0f} GB.",
        f"- {TARGET_RECORDS} records: {seconds:.0f} s on {cores()} cores"
        + ("" if full else f" at the rate of {target['records']}")
        + f", {target['peak'] / 1e6:.0f} MB of memory at most.",
        "",
        "| machines of 32 cores | 10⁷ records take | parts finished a second | written, all together |",
        "|---|---|---|---|",
    ]
    for machines in (1, 4, 16, 64):
        rate = machines * 32 / core_seconds
        lines.append(
            f"| {machines} | {1e7 / rate / 3600:.2g} h | {rate / 50:.0f} | {rate * size / 1e6:.0f} MB/s |"
        )
    return "\n".join(lines)


def main(path: str, *, full: bool) -> None:
    """Write the measured block of a document anew."""
    file = Path(path)
    before, _, rest = file.read_text(encoding="utf-8").partition("<!-- measured -->")
    _, _, after = rest.partition("<!-- end of measured -->")
    load = f"load average {os.getloadavg()[0]:.1f} before"
    stamp = f"Measured on {time.strftime('%Y-%m-%d')}, {cores()} cores, {load}, by the command above."
    block = f"{before}<!-- measured -->\n{stamp}\n\n{measured(full=full)}\n<!-- end of measured -->{after}"
    write_text(file, block)


if __name__ == "__main__":
    main(sys.argv[1], full="--full" in sys.argv)
