"""Running a campaign: parts handed to threads, to processes, or to the workers of a dask cluster, and what is done noted.

A part is one task: draw, run as native batches, measure, write (`bench.campaign.task`). Tasks share nothing, so that one way
of running them serves all (`bench.campaign.means`).
"""

from __future__ import annotations

import contextlib
import time
from collections import deque
from collections.abc import Callable, Mapping
from concurrent.futures import FIRST_COMPLETED, Future, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

from bench.campaign.lock import CampaignError
from bench.campaign.means import cores, means_of
from bench.campaign.parts import counts
from bench.campaign.plan import Plan
from bench.campaign.reading import plan_from_dict, read_plan
from bench.campaign.size import check_size
from bench.campaign.store import Store
from bench.campaign.task import generator_of, payload_of
from bench.errors import ParameterError


@dataclass(frozen=True)
class ExecutionSettings:
    """Numbers of `bench.campaign.execution`."""

    crashes_allowed: int = 3
    """Times that a part may take a worker process down with it before the campaign stops."""


SETTINGS = ExecutionSettings()


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
                with means_of(workers, threads, scheduler, store) as (submit, window, means):
                    _run(left, lambda part: submit(payload, str(store.folder), part), window, store, tally)
                store.check_present(entries)
            status = "complete"
        finally:
            if status == "stopped":  # between the note of a part and its tally, a signal may have come
                noted = store.journal.read(plan.sha256).entries
                entries.update({part: entry for part, entry in noted.items() if part not in entries})
                store.discard(part for part in left if part not in entries)
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
                part = pending[future]
                try:
                    entry = future.result()
                except BrokenProcessPool as error:
                    del pending[future]
                    # every part in flight breaks together; which one was the cause shows when it comes again
                    crashes[part] += 1
                    if crashes[part] > SETTINGS.crashes_allowed:
                        raise CampaignError(
                            f"a worker process died {crashes[part]} times at part {part} "
                            f"(records {tally.plan.part(part)[0]} to {tally.plan.part(part)[-1]}); the other parts are kept. "
                            "Look at the system's memory, or at the rig of these records"
                        ) from error
                    queue.appendleft(part)
                    continue
                store.note(tally.sha256, entry)
                del pending[future]  # until here a signal finds it among those to be noted
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
