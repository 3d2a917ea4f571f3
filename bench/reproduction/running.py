"""Making the items one after the other, each written as soon as it is there, so that a stopped run is taken up again."""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from bench import model_path
from bench.files import together, write_text
from bench.progress import ShowProgress
from bench.provenance import provenance, software_versions
from bench.reproduction.item import Item, Result, Shown
from bench.reproduction.registry import ItemEntry, find_entries
from bench.reproduction.writing import to_markdown, to_page


@dataclass(frozen=True)
class Reproduction:
    """Items of the dissertation, made and written.

    Attributes:
        results: One an item, in the order of the dissertation.
        files: What was written: page, Markdown and JSON table first, then the pictures.
        seconds: Time that all items took, those kept from an earlier run with the time they took then [s].
    """

    results: tuple[Result, ...]
    files: tuple[Path, ...]
    seconds: float

    @property
    def holds(self) -> bool:
        """Whether everything that can be judged holds, at least in shape."""
        return all(result.holds for result in self.results)

    def to_dict(self) -> dict[str, Any]:
        """Everything as JSON values."""
        return {
            "holds": self.holds,
            "seconds": self.seconds,
            "items": [result.to_dict() for result in self.results],
            **provenance(),
        }


@cache
def fingerprint() -> str:
    """Fingerprint of everything that can change a number: the bench's sources, models and data, and the software below it."""
    digest = hashlib.sha256(repr(software_versions()).encode())
    package, models = Path(__file__).resolve().parents[1], model_path("sdof").parent
    for folder, kinds in ((package, {".py", ".json", ".parquet", ".csv"}), (models, {".xml"})):
        for file in sorted(path for path in folder.rglob("*") if path.suffix in kinds):
            digest.update(str(file.relative_to(folder)).encode() + b"\0" + file.read_bytes())
    return digest.hexdigest()[:16]


def reproduce(
    identifiers: Sequence[str] | None,
    out: str | Path,
    *,
    fresh: bool = False,
    progress: ShowProgress = lambda label, share: None,
) -> Reproduction:
    """Make items of the dissertation and write them.

    Writes into `out`: index.html (one page), table.md, table.json, and for each item its pictures and its JSON file,
    by which a later run knows it again.

    Args:
        identifiers: Names of items ("A1", "c2") or chapters ("B"); all where None or empty.
        out: Folder for the results.
        fresh: Make items again that were already written by the same code.
        progress: Called with what is being done and the share of the whole that is done.

    Raises:
        UnknownNameError: There is no such item.
        OutputError: The folder cannot be written to.
    """
    entries = find_entries(identifiers)
    folder = Path(out)
    whole = sum(entry.weight for entry in entries)
    results, done = [], 0.0
    for entry in entries:
        result = None if fresh else _kept(folder, entry)
        if result is None:
            result = _made(folder, entry, _part(progress, entry, done / whole, entry.weight / whole))
        results.append(result)
        done += entry.weight
    progress("writing the page", 1.0)
    reproduction = Reproduction(tuple(results), (), sum(result.seconds for result in results))
    files = [folder / name for name in ("index.html", "table.md", "table.json")]
    with together():
        to_page(results, folder).write(files[0])
        write_text(files[1], to_markdown(results))
        write_text(
            files[2], json.dumps(reproduction.to_dict(), indent=1, ensure_ascii=False, allow_nan=False)
        )
    pictures = [folder / name for result in results for name in (shown.file for shown in result.pictures)]
    return Reproduction(reproduction.results, (*files, *pictures), reproduction.seconds)


def _part(progress: ShowProgress, entry: ItemEntry, start: float, share: float) -> ShowProgress:
    def report(label: str, inner: float) -> None:
        progress(f"{entry.identifier}: {label}", start + share * min(max(inner, 0.0), 1.0))

    report(entry.title, 0.0)
    return report


def _file(folder: Path, entry: ItemEntry) -> Path:
    return folder / f"{entry.identifier}.json"


def _kept(folder: Path, entry: ItemEntry) -> Result | None:
    """The item as an earlier run wrote it; None where there is none of this version, or a picture is missing."""
    try:
        result = Result.from_dict(json.loads(_file(folder, entry).read_text(encoding="utf-8")))
    except (OSError, ValueError, KeyError, TypeError):
        return None
    present = all((folder / shown.file).is_file() for shown in result.pictures)
    return result if result.version == fingerprint() and present else None


def _made(folder: Path, entry: ItemEntry, progress: ShowProgress) -> Result:
    from bench.figures import save  # noqa: PLC0415  (matplotlib, which a kept item does not need)

    start = time.perf_counter()
    item: Item = entry.run(progress)
    pictures = []
    for picture in item.pictures:
        name = f"{entry.identifier}_{picture.name}.png"
        save(picture.figure, folder / name, dpi=110.0)
        pictures.append(Shown(name, picture.caption, picture.shows))
    result = Result(
        entry.identifier,
        entry.title,
        item.text,
        item.searched,
        item.rows,
        tuple(pictures),
        time.perf_counter() - start,
        fingerprint(),
    )
    # Last, so that an item is known again only when all of it is there.
    write_text(
        _file(folder, entry), json.dumps(result.to_dict(), indent=1, ensure_ascii=False, allow_nan=False)
    )
    return result
