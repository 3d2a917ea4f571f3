"""What runs the parts of a campaign: a pool of threads, a pool of processes, or an existing dask cluster.

Threads are the default: MuJoCo and the compiled loops run without the GIL, and a thread writes its part while the others
simulate.
"""

from __future__ import annotations

import os
import secrets
import signal
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from bench.campaign.lock import CampaignError
from bench.campaign.store import Store
from bench.campaign.task import run_part
from bench.campaign.versions import differing, versions
from bench.files import write_text

Submit = Callable[[str, str, int], "Future[dict[str, Any]]"]
"""Hands a part to a worker: payload, folder, number."""


def cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@contextmanager
def means_of(
    workers: int | None, threads: int | None, scheduler: str | None, store: Store
) -> Iterator[tuple[Submit, Callable[[], int], str]]:
    """What runs the tasks: how to submit one, how many to keep in flight, and its name.

    Args:
        workers: Processes.
        threads: Threads a process, or a task on a cluster.
        scheduler: Address of a dask scheduler.
        store: The folder of the campaign.

    Raises:
        CampaignError: The cluster cannot be used.
    """
    if scheduler is not None:
        with _cluster(scheduler, threads or 1, store) as found:
            yield found
    elif workers is None or workers == 1:
        count = threads or cores()
        with ThreadPoolExecutor(count, thread_name_prefix="campaign") as pool:
            yield (
                (lambda *task: pool.submit(run_part, *task)),  # pyrefly: ignore[bad-argument-type]
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
    # a word of this moment, since a worker's own disk may hold a folder of the same name, with an older state of the campaign
    word = secrets.token_hex(8)
    write_text(store.folder / ".partial" / "word", word)
    for worker, seen in client.run(_read_word, str(store.folder / ".partial" / "word")).items():
        if seen != word:
            raise CampaignError(
                f"worker {worker} does not see {store.folder}; put `out` on a disk that all workers share"
            )
    here, all_there = versions(), client.run(versions)
    for worker, there in all_there.items():
        different = differing(there, here)
        if different:
            raise CampaignError(f"worker {worker} has {different}; install the same versions everywhere")
    return len(all_there)


def _read_word(path: str) -> str:
    """What a worker finds in a file; empty where it does not see it."""
    try:
        return Path(path).read_text(encoding="utf-8")
    except OSError:
        return ""
