"""The windows of a campaign for torch's loaders; importing this module imports torch."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Protocol

from torch.utils.data import IterableDataset, get_worker_info


class Tuple(Protocol):
    """A named tuple."""

    def _asdict(self) -> dict[str, Any]: ...


class Divisible(Protocol):
    """Windows that can be divided among processes, as `bench.campaign.windows.Windows` can."""

    def share(self, rank: int, count: int) -> Iterator[Tuple]:
        """Those of one process of several."""
        ...

    def __len__(self) -> int: ...


class WindowDataset(IterableDataset):
    """Windows as dictionaries, divided among the processes of a loader.

    Args:
        windows: The windows.
    """

    def __init__(self, windows: Divisible) -> None:
        self.windows = windows

    def __iter__(self) -> Iterator[dict[str, Any]]:
        worker = get_worker_info()
        rank, count = (0, 1) if worker is None else (worker.id, worker.num_workers)
        return (window._asdict() for window in self.windows.share(rank, count))

    def __len__(self) -> int:
        return len(self.windows)
