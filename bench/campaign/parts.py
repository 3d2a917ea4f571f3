"""When a part is finished: its files agree with what was noted of them when they were written, from the bytes in memory.

What is there is never hashed to be believed. `part_entry` hashes what is about to be written; `fault` holds the files against it:

* in `verify`, every byte: size, sha256, then number of rows, record numbers and plan as the footer tells them;
* at a resume, which must not read a terabyte: the file's size, its times of change and its inode are those noted when it was
  moved into place, and its footer (number of rows, least and largest record number) hashes to what was noted. The time of
  change (ctime) is set by the system at every write, truncation, rename and link, and cannot be set back, so that a file that
  agrees is the one that was written. Where it does not (a copied campaign, another disk), the whole file is hashed, and must
  hash to what was noted. What only `verify` can find is a disk that gives other bytes than it took, and a change within the
  tick of the file system's clock (some ms) in which the part was moved into place.
"""

from __future__ import annotations

import hashlib
import os
import stat
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from bench.campaign.plan import PLAN_LIMITS, Plan
from bench.errors import FileFormatError

FOLDERS = ("samples", "records", "answers")
"""Folders of the files of a part."""


@dataclass(frozen=True)
class PartsSettings:
    """Numbers of `bench.campaign.parts`."""

    tail: int = 8
    """Bytes at the end of a Parquet file: length of the footer and "PAR1"."""


SETTINGS = PartsSettings()


@dataclass(frozen=True)
class Layout:
    """What the files of a campaign must be, as its plan or the public part of it in the manifest tells.

    Attributes:
        sha256: Hash of the whole plan.
        records: Records of the campaign.
        records_per_part: Records of a part, the last one maybe fewer.
        n_samples: Samples a record.
        withholds: Whether there are answers.
    """

    sha256: str
    records: int
    records_per_part: int
    n_samples: int
    withholds: bool

    @classmethod
    def of(cls, plan: Plan) -> Layout:
        """The layout of a plan."""
        return cls(plan.sha256, plan.records, plan.records_per_part, plan.n_samples, plan.withholds)

    @classmethod
    def of_manifest(cls, manifest: Mapping[str, Any]) -> Layout:
        """The layout that a manifest tells of.

        Raises:
            FileFormatError: Its entries are not those of a manifest.
        """
        try:
            plan = manifest["plan"]
            made = cls(
                str(manifest["plan_sha256"]),
                int(plan["records"]),
                int(plan["records_per_part"]),
                round(plan["duration"] * plan["sample_rate"]),
                "seed" not in plan,
            )
            if min(made.records, made.records_per_part, made.n_samples) < 1:
                raise ValueError("numbers of records and samples are positive")
            exceeded = PLAN_LIMITS.exceeded(made.records, made.n_samples, made.n_parts)
            if exceeded is not None:
                raise ValueError(f"more than {exceeded[1]} {exceeded[0]}, which no plan can ask for")
        except (KeyError, TypeError, ValueError, OverflowError) as error:
            raise FileFormatError(f"the manifest is damaged: {error!r} in its plan") from error
        return made

    @property
    def n_parts(self) -> int:
        """Parts of the data set."""
        return -(-self.records // self.records_per_part)

    @property
    def kinds(self) -> tuple[str, ...]:
        """Folders of the data set."""
        return FOLDERS if self.withholds else FOLDERS[:2]

    def part(self, index: int) -> range:
        """Records of a part."""
        return range(index * self.records_per_part, min((index + 1) * self.records_per_part, self.records))


def part_name(index: int) -> str:
    """File name of a part."""
    return f"part-{index:06d}.parquet"


def part_entry(layout: Layout, part: int, failed: list[int], contents: Mapping[str, bytes]) -> dict[str, Any]:
    """What journal and manifest say of a part.

    Args:
        layout: The layout.
        part: Number of the part.
        failed: Records of it that failed.
        contents: The bytes of its files, by folder.
    """
    records = len(layout.part(part))
    return {
        "part": part,
        "first": part * layout.records_per_part,
        "records": records,
        "ok": records - len(failed),
        "failed": failed,
        "rows": (records - len(failed)) * layout.n_samples,
        "files": {
            kind: {"bytes": len(contents[kind]), "sha256": hashlib.sha256(contents[kind]).hexdigest()}
            for kind in FOLDERS
            if kind in contents
        },
    }


def mark_of(path: Path, content: bytes | None = None) -> list[Any]:
    """What a resume knows a file by: times of change [ns], inode, hash of the footer.

    Args:
        path: The file, in its place.
        content: What was written; the footer is read from the file where it is not given.
    """
    signature = _signature(path.lstat())  # first: a change while the footer is read shows in the times
    footer = _footer(path) if content is None else content[-_footer_length(content) :]
    return [*signature, _footer_hash(footer)]


def public(entry: Mapping[str, Any]) -> dict[str, Any]:
    """The entry as it stands in the manifest, without the marks, which are of one disk and one moment."""
    return {key: value for key, value in entry.items() if key != "marks"}


def fault(folder: Path, layout: Layout, entry: Mapping[str, Any], *, whole: bool) -> tuple[str, str] | None:
    """The first way in which the files of a part are not as they were noted.

    Args:
        folder: Folder of the campaign.
        layout: Its layout.
        entry: What was noted.
        whole: Hash every file, whatever its times of change.

    Returns:
        Folder of the file and what is wrong with it; None where all is as it was written.
    """
    for kind in layout.kinds:
        wrong = file_fault(folder / kind / part_name(entry["part"]), layout, entry, kind, whole=whole)
        if wrong:
            return kind, wrong
    return None


def file_fault(path: Path, layout: Layout, entry: Mapping[str, Any], kind: str, *, whole: bool) -> str:
    """What is wrong with one file of a part; empty where it is as it was noted."""
    try:
        state = path.lstat()
    except OSError:
        return "is missing"
    if stat.S_ISLNK(state.st_mode):
        return "is a link"
    if not stat.S_ISREG(state.st_mode):
        return "is no regular file"
    noted = entry["files"][kind]
    if state.st_size != noted["bytes"]:
        return "differs from what was written"
    mark = entry.get("marks", {}).get(kind)
    try:
        if mark is not None and not whole and list(mark[:-1]) == _signature(state):
            return "" if _footer_hash(_footer(path)) == mark[-1] else "differs from what was written"
        with path.open("rb") as stream:
            if hashlib.file_digest(stream, "sha256").hexdigest() != noted["sha256"]:
                return "differs from what was written"
    except OSError as error:
        return f"cannot be read ({error.strerror or error})"
    return _footer_fault(path, layout, entry, kind)


def is_entry(layout: Layout, entry: Any) -> bool:
    """Whether an entry is one of this plan at all; it may come from a manifest that was changed."""
    try:
        failed, part = list(entry["failed"]), entry["part"]
        records = layout.part(part) if 0 <= part < layout.n_parts else range(0)
        return (
            len(records) > 0
            and set(failed) <= set(records)
            and len(set(failed)) == len(failed)
            and entry == {**part_entry(layout, part, failed, {}), "files": entry["files"]}
            and all(
                isinstance(entry["files"][kind]["bytes"], int)
                and isinstance(entry["files"][kind]["sha256"], str)
                for kind in layout.kinds
            )
        )
    except (KeyError, TypeError, ValueError, AttributeError):
        return False


def _footer_fault(path: Path, layout: Layout, entry: Mapping[str, Any], kind: str) -> str:
    """Whether number of rows, record numbers and plan in the footer are those of the part."""
    import pyarrow as pa  # noqa: PLC0415
    import pyarrow.parquet as pq  # noqa: PLC0415

    records = layout.part(entry["part"])
    good = sorted(set(records) - set(entry["failed"])) if kind == "samples" else list(records)
    rows = entry["rows"] if kind == "samples" else entry["records"]
    try:
        metadata = pq.read_metadata(path)
        groups = [metadata.row_group(group) for group in range(metadata.num_row_groups)]
        groups = [group.column(0).statistics for group in groups if group.num_rows]
        ends = (min(group.min for group in groups), max(group.max for group in groups)) if groups else None
        named = metadata.schema.column(0).name == "record"
    except (pa.ArrowException, OSError, AttributeError, TypeError) as error:
        return f"is no Parquet file of a campaign ({(str(error).splitlines() or [''])[0]})"
    if not named or metadata.num_rows != rows or ends != ((good[0], good[-1]) if good else None):
        return f"does not hold the records {records[0]} to {records[-1]}"
    told = (metadata.metadata or {}).get(b"jointbench", layout.sha256.encode())
    return "" if layout.sha256.encode() in told else "is of another plan"


def _signature(state: os.stat_result) -> list[int]:
    return [state.st_mtime_ns, state.st_ctime_ns, state.st_ino]


def _footer_hash(footer: bytes) -> str:
    return hashlib.sha256(footer).hexdigest()[:32]


def _footer_length(tail: bytes) -> int:
    return int.from_bytes(tail[-SETTINGS.tail : -4], "little") + SETTINGS.tail


def _footer(path: Path) -> bytes:
    with path.open("rb") as file:
        size = file.seek(0, os.SEEK_END)
        file.seek(max(0, size - SETTINGS.tail))
        length = min(_footer_length(file.read(SETTINGS.tail)), size)
        file.seek(size - length)
        return file.read(length)


def manifest_entries(manifest: Mapping[str, Any], layout: Layout) -> dict[int, dict[str, Any]]:
    """Entries of a manifest by part, as far as they are entries of its plan at all."""
    parts = manifest.get("parts")
    return {
        entry["part"]: entry
        for entry in (parts if isinstance(parts, list) else [])
        if is_entry(layout, entry)
    }


def strangers(folder: Path, layout: Layout) -> list[tuple[Path, str]]:
    """What lies in the folders of the data set without being a file of it, and why not."""
    found = []
    names = {part_name(part) for part in range(layout.n_parts)}
    for kind in layout.kinds:
        if not (folder / kind).is_dir():
            continue
        with os.scandir(folder / kind) as present:
            for item in sorted(present, key=lambda item: item.name):
                if item.name not in names and (kind, item.name) != ("answers", "answers.json"):
                    found.append((Path(item.path), "is not of this campaign"))
                elif item.is_symlink():
                    found.append((Path(item.path), "is a link"))
                elif not item.is_file():
                    found.append((Path(item.path), "is no file"))
    return found


def any_part(folder: Path, layout: Layout) -> bool:
    """Whether any file of a part is there."""
    return any(next((folder / kind).glob("part-*"), None) is not None for kind in layout.kinds)


def counts(entries: list[Mapping[str, Any]] | list[dict[str, Any]]) -> dict[str, int]:
    """Sums over the entries of parts."""
    return {
        "records": sum(entry["records"] for entry in entries),
        "ok": sum(entry["ok"] for entry in entries),
        "failed": sum(len(entry["failed"]) for entry in entries),
        "rows": sum(entry["rows"] for entry in entries),
        "bytes": sum(file["bytes"] for entry in entries for file in entry["files"].values()),
    }
