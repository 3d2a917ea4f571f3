"""The windows of a campaign for torch's loaders; importing this module imports torch."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from torch.utils.data import IterableDataset, get_worker_info

if TYPE_CHECKING:
    from bench.campaign.windows import Windows


class WindowDataset(IterableDataset):
    """Windows as dictionaries, divided among the processes of a loader.

    Args:
        windows: The windows.
    """

    def __init__(self, windows: Windows) -> None:
        self.windows = windows

    def __iter__(self) -> Iterator[dict[str, Any]]:
        worker = get_worker_info()
        rank, count = (0, 1) if worker is None else (worker.id, worker.num_workers)
        return (window._asdict() for window in self.windows.share(rank, count))

    def __len__(self) -> int:
        return len(self.windows)
