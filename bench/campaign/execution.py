"""Running a campaign: parts handed to threads, to processes, or to the workers of a dask cluster, and what is done noted.

A part is one task: draw, run as native batches, measure, write. Tasks share nothing, so that one way of running them
serves all: a pool of threads (the default; MuJoCo and the compiled loops run without the GIL, and a thread writes its
part while the others simulate), a pool of processes (`workers`), or an existing dask cluster (`scheduler`).
"""

from __future__ import annotations

import contextlib
import json
import os
import signal
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import (
    FIRST_COMPLETED,
    Executor,
    Future,
    ProcessPoolExecutor,
    ThreadPoolExecutor,
    wait,
)
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from bench.campaign.plan import Plan
from bench.campaign.reading import plan_from_dict, read_plan
from bench.campaign.size import check_size
from bench.campaign.store import BYTES_DEPEND_ON, CampaignError, Store, counts, versions
from bench.errors import ParameterError

if TYPE_CHECKING:
    from bench.campaign.generation import Generator

CRASHES_ALLOWED = 3
"""Times that a part may take a worker process down with it before the campaign stops."""
_loading = threading.Lock()


class Progress(NamedTuple):
    """How far a campaign is.

    Attributes:
        records: Records finished, those found from earlier runs included.
        planned: Records of the campaign.
        failed: Records set aside.
        rate: Records a second of this run.
        elapsed: Time of this run [s].
        left: Time left at this rate [s].
    """

    records: int
    planned: int
    failed: int
    rate: float
    elapsed: float
    left: float


@dataclass(frozen=True)
class CampaignResult:
    """What a run of a campaign did.

    Attributes:
        folder: The data set.
        name: Name of the campaign.
        status: "complete", as a run that ends well leaves it.
        planned: Records of the campaign.
        records: Records finished, the failed ones included.
        resumed: Of these, records found from earlier runs.
        failed: Records set aside.
        failures: The first hundred of them; their reasons stand in the table of the records or in the answers.
        parts: Parts of the data set.
        rows: Samples in the data set.
        size: Size of the data set [bytes].
        seconds: Time of this run [s].
        means: What ran it.
        found: What was not as it had been written, a line each; it was made again, or set aside where it was of others.
    """

    folder: str
    name: str
    status: str
    planned: int
    records: int
    resumed: int
    failed: int
    failures: tuple[int, ...]
    parts: int
    rows: int
    size: int
    seconds: float
    means: str
    found: tuple[str, ...] = ()

    @property
    def rate(self) -> float:
        """Records a second of this run."""
        return (self.records - self.resumed) / max(self.seconds, 1e-9)

    def to_dict(self) -> dict[str, Any]:
        """JSON form, with the rate [records/s]."""
        return {**asdict(self), "failures": list(self.failures), "found": list(self.found), "rate": self.rate}


def run_campaign(
    plan: str | Path | Plan | Mapping[str, Any],
    out: str | Path,
    *,
    workers: int | None = None,
    threads: int | None = None,
    scheduler: str | None = None,
    progress: Callable[[Progress], None] | None = None,
    resume: bool = True,
) -> CampaignResult:
    """Run a campaign, or what is left of it, into a folder.

    The bytes of the data set depend on the plan and the versions of the software, not on how it is run or how often it was
    interrupted. A record that fails is set aside, reported and counted.

    Args:
        plan: A plan, its file (TOML or JSON) or its document.
        out: Folder of the data set, new or of the same campaign.
        workers: Processes; 1 by default.
        threads: Threads a process; by default all cores divided by the workers. With a scheduler, threads a task (1).
        scheduler: Address of a dask scheduler, as "tcp://10.0.0.1:8786", whose workers see `out` under the same path.
        progress: Called with the state after each part.
        resume: Go on where `out` holds part of this campaign.

    Returns:
        What was done.

    Raises:
        CampaignError: The folder cannot be used, or a part repeatedly takes its worker down.
        BenchError: The plan is wrong, or the folder cannot be written to.
    """
    plan = _plan_of(plan)
    _check_means(workers, threads, scheduler)
    payload = payload_of(plan)
    generator = generator_of(payload)
    at_once = 0 if scheduler else (workers or 1) if (workers or 1) > 1 else threads or cores()
    check_size(generator, Path(out).resolve(), at_once=at_once)
    generator.check()
    channels = [
        {"name": channel.name, "unit": channel.unit, "quantity": channel.quantity, "role": channel.role}
        for channel in generator.channels
    ]
    store, start = Store(out), time.perf_counter()
    with store.opened(plan, channels, resume=resume) as (entries, found):
        tally = _Tally(plan, entries, progress)
        left = [part for part in range(plan.n_parts) if part not in entries]
        status, means = "stopped", "nothing left to run"
        try:
            if left:
                with _means(workers, threads, scheduler, store) as (submit, window, means):
                    _run(left, lambda part: submit(payload, str(store.folder), part), window, store, tally)
            status = "complete"
        finally:
            store.write_manifest(plan, channels, entries, status=status)
    made = _result(store, status, tally, seconds=time.perf_counter() - start, means=means)
    return replace(made, found=tuple(found))


def _plan_of(plan: str | Path | Plan | Mapping[str, Any]) -> Plan:
    if isinstance(plan, Plan):
        return plan
    return plan_from_dict(plan) if isinstance(plan, Mapping) else read_plan(plan)


def _check_means(workers: int | None, threads: int | None, scheduler: str | None) -> None:
    """Raise `ParameterError` for numbers below 1, and for workers beside a scheduler."""
    for name, value in (("workers", workers), ("threads", threads)):
        if value is not None and (isinstance(value, bool) or value < 1):
            raise ParameterError(f"{name} is {value!r}; a whole number of at least 1 is expected")
    if scheduler is not None and workers is not None:
        raise ParameterError(
            "workers came together with a scheduler, which has workers of its own; give one of them"
        )


def _result(store: Store, status: str, tally: _Tally, *, seconds: float, means: str) -> CampaignResult:
    """What was done, from the entries of the finished parts."""
    entries = list(tally.entries.values())
    done = counts(entries)
    failed = sorted(record for entry in entries for record in entry["failed"])
    return CampaignResult(
        folder=str(store.folder),
        name=tally.plan.name,
        status=status,
        planned=tally.plan.records,
        records=done["records"],
        resumed=tally.before,
        failed=done["failed"],
        failures=tuple(failed[:100]),
        parts=len(entries),
        rows=done["rows"],
        size=done["bytes"],
        seconds=seconds,
        means=means,
    )


def payload_of(plan: Plan) -> str:
    """A plan as text for another process."""
    return json.dumps({"plan": plan.to_dict(), "folder": plan.rigs[0].folder}, ensure_ascii=False)


def generator_of(payload: str) -> Generator:
    """The generator of a plan, made once a process."""
    with _loading:
        return _generator(payload)


@lru_cache(maxsize=2)
def _generator(payload: str) -> Generator:
    from bench.campaign.generation import Generator  # noqa: PLC0415  (MuJoCo and the compiled code)

    document = json.loads(payload)
    return Generator(plan_from_dict(document["plan"], folder=document["folder"]))


def run_part(payload: str, folder: str, part: int, threads: int = 1) -> dict[str, Any]:
    """Generate and write one part; the task that threads, processes and clusters run.

    Args:
        payload: The plan, as from `payload_of`.
        folder: Folder of the campaign.
        part: Number of the part.
        threads: Threads of its native batches.

    Returns:
        Its entry in the manifest.
    """
    from bench.campaign.tables import part_contents  # noqa: PLC0415

    generator = generator_of(payload)
    made = generator.part(part, threads=threads)
    failed = [failure.record for failure in made.failures]
    return Store(folder).write_part(generator.plan, part, failed, part_contents(generator, made))


class _Tally:
    """Entries of the finished parts, and the progress that they make."""

    def __init__(
        self, plan: Plan, entries: dict[int, dict[str, Any]], report: Callable[[Progress], None] | None
    ) -> None:
        self.plan, self.entries, self.report = plan, entries, report
        self.sha256 = plan.sha256
        done = counts(list(entries.values()))
        self.before = self.records = done["records"]
        self.failed = done["failed"]
        self.start = time.perf_counter()

    def add(self, entry: dict[str, Any]) -> None:
        self.entries[entry["part"]] = entry
        self.records += entry["records"]
        self.failed += len(entry["failed"])
        if self.report is None:
            return
        elapsed = time.perf_counter() - self.start
        rate = (self.records - self.before) / max(elapsed, 1e-9)
        left = (self.plan.records - self.records) / rate
        self.report(Progress(self.records, self.plan.records, self.failed, rate, elapsed, left))


Submit = Callable[[str, str, int], "Future[dict[str, Any]]"]


def _run(
    parts: list[int], submit: Callable[[int], Future], window: Callable[[], int], store: Store, tally: _Tally
) -> None:
    """Keep a window of parts in flight until all are done and noted; when one raises, note those that are being made."""
    queue, pending, crashes = deque(parts), {}, dict.fromkeys(parts, 0)
    try:
        while queue or pending:
            while queue and len(pending) < window():
                part = queue.popleft()
                pending[submit(part)] = part
            for future in wait(pending, return_when=FIRST_COMPLETED).done:
                part = pending.pop(future)
                try:
                    entry = future.result()
                except BrokenProcessPool as error:
                    # every part in flight breaks together; which one was the cause shows when it comes again
                    crashes[part] += 1
                    if crashes[part] > CRASHES_ALLOWED:
                        raise CampaignError(
                            f"a worker process died {crashes[part]} times at part {part} "
                            f"(records {tally.plan.part(part)[0]} to {tally.plan.part(part)[-1]}); the other parts are kept. "
                            "Look at the system's memory, or at the rig of these records"
                        ) from error
                    queue.appendleft(part)
                    continue
                store.note(tally.sha256, entry)
                tally.add(entry)
    except BaseException:
        _note_running(list(pending), store, tally)
        raise


def _note_running(futures: list[Future], store: Store, tally: _Tally) -> None:
    """Give up the parts that no worker has begun; wait for the others, whose files are moved into place, and note them."""
    for future in [future for future in futures if not future.cancel()]:
        with contextlib.suppress(Exception):  # another reason is being told already, or the same one
            entry = future.result()
            store.note(tally.sha256, entry)
            tally.entries[entry["part"]] = entry


def cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@contextmanager
def _means(
    workers: int | None, threads: int | None, scheduler: str | None, store: Store
) -> Iterator[tuple[Submit, Callable[[], int], str]]:
    """What runs the tasks: how to submit one, how many to keep in flight, and its name."""
    if scheduler is not None:
        with _cluster(scheduler, threads or 1, store) as found:
            yield found
    elif workers is None or workers == 1:
        count = threads or cores()
        with ThreadPoolExecutor(count, thread_name_prefix="campaign") as pool:
            yield (
                (lambda *task: pool.submit(run_part, *task)),
                (lambda: count + 1),  # a thread goes on with the next part while its last one is noted
                f"{count} thread{'s' * (count > 1)}",
            )
    else:
        count = threads or max(1, cores() // workers)
        processes = _Processes(workers, count)
        try:
            yield (
                processes.submit,
                (lambda: workers + 1),
                f"{workers} processes of {count} thread{'s' * (count > 1)}",
            )
        finally:
            processes.pool.shutdown(cancel_futures=True)


class _Processes:
    """A pool of processes that is made anew when one of them dies."""

    def __init__(self, workers: int, threads: int) -> None:
        self.workers, self.threads = workers, threads
        self.pool: Executor = self._made()

    def _made(self) -> ProcessPoolExecutor:
        from multiprocessing import get_context  # noqa: PLC0415

        # not fork: MuJoCo's and numba's threads would not survive it
        return ProcessPoolExecutor(
            self.workers, mp_context=get_context("spawn"), initializer=_leave_with_parent
        )

    def submit(self, payload: str, folder: str, part: int) -> Future:
        try:
            return self.pool.submit(run_part, payload, folder, part, self.threads)
        except BrokenProcessPool:
            self.pool.shutdown(wait=False)
            self.pool = self._made()
            return self.pool.submit(run_part, payload, folder, part, self.threads)


def _leave_with_parent() -> None:
    """End this worker when the process that started it is killed; it would wait for work for ever.

    Ctrl-C reaches all processes of a terminal; the one that started the others stops them in order.
    """
    from multiprocessing import parent_process  # noqa: PLC0415

    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = parent_process()
    if parent is None:
        return

    def watch() -> None:
        parent.join()
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


@contextmanager
def _cluster(address: str, threads: int, store: Store) -> Iterator[tuple[Submit, Callable[[], int], str]]:
    try:
        from distributed import Client  # noqa: PLC0415
    except ImportError as error:
        raise CampaignError("a scheduler needs dask.distributed: pip install 'jointbench[scale]'") from error
    try:
        client = Client(address, timeout=10)
    except (OSError, TimeoutError, ValueError) as error:
        raise CampaignError(
            f"no dask scheduler answers at {address} ({error}); start one with `dask scheduler`"
        ) from error
    with client:
        workers = _check_workers(client, store)
        executor = client.get_executor(pure=False, retries=2)

        def window() -> int:  # workers may join and leave
            return max(2, 2 * sum(client.nthreads().values()))

        def submit(payload: str, folder: str, part: int) -> Future:
            return executor.submit(run_part, payload, folder, part, threads)

        yield submit, window, f"{workers} dask workers at {address}"


def _check_workers(client: Any, store: Store) -> int:
    """Number of the workers; raise `CampaignError` unless all workers see the folder and hold the same software."""
    for worker, sees in client.run(os.path.exists, str(store.manifest_path)).items():
        if not sees:
            raise CampaignError(
                f"worker {worker} does not see {store.folder}; put `out` on a disk that all workers share"
            )
    here, all_there = versions(), client.run(versions)
    for worker, there in all_there.items():
        different = [
            f"{name} {there.get(name)} (here {here[name]})"
            for name in BYTES_DEPEND_ON
            if there.get(name) != here[name]
        ]
        if different:
            raise CampaignError(
                f"worker {worker} has {', '.join(different)}; install the same versions everywhere"
            )
    return len(all_there)
