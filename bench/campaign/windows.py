"""Reading a campaign in windows, shuffled, within a memory that does not grow with the data set.

A whole shuffle would need the whole data set at hand. Here row groups (a record each, or a few short ones) are visited in
random order, some of them are held at a time, and the windows of those are shuffled among each other: two windows of
one record are as far apart as the buffer is long.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bench.campaign.store import Store
from bench.campaign.tables import records_per_group
from bench.errors import BenchError, FileFormatError, ParameterError, UnknownNameError


class Window(NamedTuple):
    """A window of a record, or with `Windows.batches` several, along a leading axis.

    Attributes:
        record: Number of the record.
        start: First sample within the record.
        values: ``(length, n_channels)``, NaN where the record's rig lacks a channel.
        parameters: What the record drew ``(n_parameters,)``, NaN where it does not apply.
    """

    record: int | NDArray[np.int64]
    start: int | NDArray[np.int64]
    values: NDArray
    parameters: NDArray[np.float64]


class Windows:
    """An iterable over the windows of a campaign.

    Each iteration is one epoch; the same seed and epoch give the same windows in the same order. Fit for
    `torch.utils.data.DataLoader` by `torch`, which also divides the parts among the loader's processes; torch is not
    needed otherwise.

    Args:
        folder: The campaign; finished parts of a running one are read as well.
        length: Samples a window.
        stride: Samples from one window of a record to the next; `length` by default.
        channels: Channels, in this order; all by default.
        parameters: Columns of the table of the records to give along.
        shuffle: Shuffle; in order of records otherwise.
        seed: Seed of the shuffle.
        buffer: Row groups held at a time.

    Raises:
        FileFormatError: The folder is no campaign.
        UnknownNameError: A channel or parameter that it does not have.
        ParameterError: A length, stride or buffer that is not possible.

    Example:
        >>> for window in Windows("out/campaign", 1000, channels=["shaker", "displacement"]):  # doctest: +SKIP
        ...     window.values.shape
        (1000, 2)
    """

    def __init__(
        self,
        folder: str | Path,
        length: int,
        *,
        stride: int | None = None,
        channels: Sequence[str] | None = None,
        parameters: Sequence[str] = (),
        shuffle: bool = True,
        seed: int = 0,
        buffer: int = 16,
    ) -> None:
        self.folder = Path(folder)
        store = Store(folder)
        manifest = store.manifest()
        plan = manifest["plan"]
        self.n_samples = round(plan["duration"] * plan["sample_rate"])
        self.length, self.stride = length, length if stride is None else stride
        for name, value, most in (
            ("length", length, self.n_samples),
            ("stride", self.stride, None),
            ("buffer", buffer, None),
        ):
            if isinstance(value, bool) or value < 1 or (most is not None and value > most):
                raise ParameterError(
                    f"{name} of the windows is {value!r}; a whole number of at least 1"
                    f"{f' and at most {most}, a record,' if most else ''} is expected"
                )
        known = [channel["name"] for channel in manifest["channels"]]
        self.channels = tuple(known if channels is None else channels)
        for name in self.channels:
            if name not in known:
                raise UnknownNameError("channel of the campaign", name, known)
        self.parameters = tuple(parameters)
        self.shuffle, self.seed, self.buffer = shuffle, seed, buffer
        self.epoch = 0
        self._per_group = records_per_group(self.n_samples)
        entries = {entry["part"]: entry["ok"] for entry in manifest["parts"]}
        if manifest["status"] != "complete":
            entries |= _journaled(store)
        self._groups = [
            (part, group, min(self._per_group, ok - group * self._per_group))
            for part, ok in sorted(entries.items())
            for group in range(-(-ok // self._per_group))
        ]
        self._store = store
        if self._groups and self.parameters:
            self._drawn(self._groups[0][0])

    @property
    def per_record(self) -> int:
        """Windows a record."""
        return (self.n_samples - self.length) // self.stride + 1

    def __len__(self) -> int:
        return self.per_record * sum(count for _, _, count in self._groups)

    def set_epoch(self, epoch: int) -> None:
        """Choose the epoch of the next iteration; the order of the windows depends on it and on the seed."""
        self.epoch = epoch

    def __iter__(self) -> Iterator[Window]:
        return self.share(0, 1)

    def share(self, rank: int, count: int) -> Iterator[Window]:
        """The windows that one of `count` readers gets; together they get each window once.

        Args:
            rank: Number of the reader, from 0.
            count: Readers.
        """
        rng = np.random.default_rng(np.random.SeedSequence(self.seed, spawn_key=(self.epoch,)))
        order = rng.permutation(len(self._groups)) if self.shuffle else np.arange(len(self._groups))
        own = np.random.default_rng(np.random.SeedSequence(self.seed, spawn_key=(self.epoch, rank)))
        mine = order[rank::count]
        for first in range(0, len(mine), self.buffer):
            held = [self._read(*self._groups[index]) for index in mine[first : first + self.buffer]]
            places = [
                (h, r, s)
                for h, (records, _, _) in enumerate(held)
                for r in range(len(records))
                for s in range(0, self.n_samples - self.length + 1, self.stride)
            ]
            for place in own.permutation(len(places)) if self.shuffle else range(len(places)):
                h, r, s = places[place]
                records, values, drawn = held[h]
                # a copy: a window that is kept must not keep its record alive
                yield Window(int(records[r]), s, values[r, s : s + self.length].copy(), drawn[r])

    def batches(self, size: int) -> Iterator[Window]:
        """The windows in batches, the last one maybe smaller: values ``(size, length, n_channels)``."""
        held: list[Window] = []
        for window in self:
            held.append(window)
            if len(held) == size:
                yield _stacked(held)
                held = []
        if held:
            yield _stacked(held)

    def torch(self) -> Any:
        """The windows as a `torch.utils.data.IterableDataset` of dictionaries, divided among a loader's processes."""
        from bench.campaign.torch_windows import WindowDataset  # noqa: PLC0415

        return WindowDataset(self)

    def _read(self, part: int, group: int, count: int) -> tuple[NDArray, NDArray, NDArray]:
        """Records ``(count,)``, values ``(count, n_samples, n_channels)`` and parameters of one row group."""
        import pyarrow.parquet as pq  # noqa: PLC0415

        path = self._store.path("samples", part)
        with _readable(path), pq.ParquetFile(path) as file:
            table = file.read_row_group(group, columns=["record", *self.channels], use_threads=False)
            if len(table) != count * self.n_samples:
                raise FileFormatError(
                    f"row group {group} of {path} has {len(table)} rows; {count} records of {self.n_samples} samples are expected: "
                    "run the campaign again to make the part again"
                )
            records = table.column("record").to_numpy()[:: self.n_samples]
            columns = [table.column(name).to_numpy().reshape(count, self.n_samples) for name in self.channels]
        drawn = np.empty((count, 0))
        if self.parameters:
            rows = self._drawn(part)
            drawn = np.stack([rows[int(record)] for record in records])
        return records, np.stack(columns, axis=2), drawn

    def _drawn(self, part: int) -> dict[int, NDArray[np.float64]]:
        return _parameters(str(self._store.path("records", part)), self.parameters)


@lru_cache(maxsize=64)
def _parameters(path: str, names: tuple[str, ...]) -> dict[int, NDArray[np.float64]]:
    """Parameters by record, of one part."""
    import pyarrow.parquet as pq  # noqa: PLC0415

    with _readable(path), pq.ParquetFile(path) as file:
        for name in names:
            if name not in file.schema_arrow.names:
                raise UnknownNameError("column of the campaign's records", name, file.schema_arrow.names)
        table = file.read(columns=["record", *names], use_threads=False)
    columns = [
        np.array([np.nan if value is None else value for value in table.column(name).to_pylist()], float)
        for name in names
    ]
    return dict(zip(table.column("record").to_pylist(), np.stack(columns, axis=1), strict=True))


@contextlib.contextmanager
def _readable(path: str | Path) -> Iterator[None]:
    """Tell what Arrow cannot read with the name of the file."""
    import pyarrow as pa  # noqa: PLC0415

    try:
        yield
    except BenchError:
        raise
    except (
        pa.ArrowException,
        OSError,
        KeyError,
        IndexError,
    ) as error:  # the latter two: a column, a row group
        raise FileFormatError(
            f"cannot read {path}: {' '.join(str(error).split())}; run the campaign again to make the part again"
        ) from error


def _journaled(store: Store) -> dict[int, int]:
    """Finished parts of a campaign that is still running, and their records."""
    return {part: entry["ok"] for part, entry in store.journaled().items()}


def _stacked(held: Sequence[Window]) -> Window:
    return Window(
        np.array([window.record for window in held]),
        np.array([window.start for window in held]),
        np.stack([window.values for window in held]),
        np.stack([window.parameters for window in held]),
    )
