"""Make docs/gallery.md with its pictures and docs/reproduction.md from what `jointbench reproduce` gives.

    python scripts/make_gallery.py          makes what is not there yet of this version in out/reproduce, then the pages
    python scripts/make_gallery.py FOLDER   takes another folder
    python scripts/make_gallery.py --items D3 C3   makes these alone; the others stay as the pages have them
    python scripts/results.py reproduce     makes all anew, with the rows of docs/results.md as well

Both pages are written from one set of results, which docs/reproduction.json keeps: a test makes them again from it.
"""

from __future__ import annotations

import io
import json
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import tyro
from PIL import Image

from bench.files import replacing, write_text
from bench.provenance import provenance
from bench.reproduction import Result, reproduce
from bench.reproduction.writing import to_gallery, to_markdown

LARGEST = 40_000
"""Most bytes of a picture: the repository keeps every version of it."""


def small_png(path: Path) -> bytes:
    """The picture with 32 colours, rare ones kept, as wide as its size allows and at most 800 pixels."""
    picture = Image.open(path).convert("RGB")
    content = b""
    for width in range(800, 200, -40):
        scale = min(width / picture.width, 1.0)
        size = (round(picture.width * scale), round(picture.height * scale))
        buffer = io.BytesIO()
        picture.resize(size, Image.Resampling.LANCZOS).quantize(32, Image.Quantize.MAXCOVERAGE).save(
            buffer, "PNG", optimize=True
        )
        content = buffer.getvalue()
        if len(content) <= LARGEST:
            break
    return content


def write_pages(results: Sequence[Result], folder: Path, docs: Path) -> None:
    """Write both pages, the pictures and the results that they are made of.

    Args:
        results: All items.
        folder: Where their pictures lie; of those that are not there the page's own stay.
        docs: The documentation's folder.
    """
    shown = {shown.file for result in results for shown in result.pictures}
    for file in sorted(file for file in shown if (folder / file).exists()):
        with replacing(docs / "gallery" / file) as temporary:
            temporary.write_bytes(small_png(folder / file))
    for stale in sorted(path for path in (docs / "gallery").glob("*.png") if path.name not in shown):
        stale.unlink()
    kept = {"items": [result.to_dict() for result in results], **provenance()}
    write_text(docs / "reproduction.json", json.dumps(kept, indent=1, ensure_ascii=False) + "\n")
    write_text(docs / "reproduction.md", to_markdown(results))
    write_text(docs / "gallery.md", to_gallery(results))


@dataclass
class Args:
    """Reproduce what is not there yet, and write gallery, table and pictures."""

    folder: tyro.conf.Positional[Path] = Path("out/reproduce")
    """Folder of `jointbench reproduce`."""
    docs: Path = Path("docs")
    """The documentation's folder."""
    items: tuple[str, ...] = ()
    """Items to make; the others stay as docs/reproduction.json has them, with the version of the code that made them."""
    fresh: bool = False
    """Make all items again."""
    json: bool = False
    """Print the results as JSON."""


def main() -> None:
    """Reproduce and write the pages."""
    args = tyro.cli(Args, description=__doc__)

    def show(label: str, share: float) -> None:
        print(f"{100 * share:3.0f} % {label}", file=sys.stderr)

    made = reproduce(args.items, args.folder, fresh=args.fresh, progress=show)
    results = made.results
    if args.items:
        kept = json.loads((args.docs / "reproduction.json").read_text(encoding="utf-8"))["items"]
        new = {result.identifier: result for result in results}
        results = tuple(new.get(item["identifier"]) or Result.from_dict(item) for item in kept)
    write_pages(results, args.folder, args.docs)
    if args.json:
        print(json.dumps(made.to_dict(), ensure_ascii=False))


if __name__ == "__main__":
    main()
