"""Make docs/gallery.md and its pictures from the folder that `jointbench reproduce` wrote.

Usage: jointbench reproduce -o out/ && python scripts/make_gallery.py out/
"""

from __future__ import annotations

import io
import json
from pathlib import Path

import tyro
from PIL import Image

from bench.files import replacing, write_text
from bench.reproduction import ENTRIES, Result
from bench.reproduction.item import HEADER

SHOWN = {
    "A1": ("histories",),
    "A2": ("phase", "surface"),
    "A3": ("histories", "loop_modulated"),
    "A4": ("loop", "estimates"),
    "A5": ("phase", "contributions"),
    "B1": ("histograms", "random"),
    "B2": ("segment", "errors"),
    "B3": ("map", "indicators"),
    "C2": ("training", "errors"),
    "C3": ("in_place",),
    "D1": ("response",),
    "D3": ("unseen_loops", "unseen_errors"),
    "D4": ("response", "step"),
}
"""Pictures of the gallery by item."""

LARGEST = 60_000
"""Most bytes of a picture: the repository keeps every version of it."""


def small_png(path: Path) -> bytes:
    """The picture with 24 colours, as wide as its size allows and at most 800 pixels."""
    picture = Image.open(path).convert("RGB")
    for width in range(800, 200, -40):
        scale = min(width / picture.width, 1.0)
        size = (round(picture.width * scale), round(picture.height * scale))
        buffer = io.BytesIO()
        picture.resize(size, Image.Resampling.LANCZOS).quantize(24).save(buffer, "PNG", optimize=True)
        if buffer.tell() <= LARGEST:
            break
    return buffer.getvalue()


def main(folder: tyro.conf.Positional[Path], docs: Path = Path("docs")) -> None:
    """Write the gallery.

    Args:
        folder: What `jointbench reproduce` wrote.
        docs: The documentation's folder.
    """
    results = [
        Result.from_dict(json.loads((folder / f"{name}.json").read_text(encoding="utf-8")))
        for name in ENTRIES
    ]
    rows = [row for result in results for row in result.rows if row.holds is not None]
    seconds = sum(result.seconds for result in results)
    lines = [
        "# Gallery: the dissertation, reproduced",
        "",
        "Systems, figures and tables of F. Tasbihgoo, *Analytical and experimental studies in the development of "
        "reduced-order computational models for nonlinear systems* (USC 2006), made again on the bench's virtual rigs by "
        "`jointbench reproduce`. The laboratory records were never published: their printed ranges stand beside ours.",
        "",
        f"{sum(bool(row.holds) for row in rows)} of {len(rows)} requirements hold; all items took {seconds:.0f} s on two cores.",
        "",
    ]
    for result in results:
        lines += [f"## {result.identifier}: {result.title}", "", result.text, ""]
        for file, caption in result.pictures:
            if file in {f"{result.identifier}_{name}.png" for name in SHOWN[result.identifier]}:
                with replacing(docs / "gallery" / file) as temporary:
                    temporary.write_bytes(small_png(folder / file))
                lines += [f"![{caption}](gallery/{file})", "", f"*{caption}*", ""]
        lines += ["| " + " | ".join(HEADER) + " |", "|" + "---|" * len(HEADER)]
        lines += [
            "| " + " | ".join(cell.replace("|", "\\|") for cell in row.cells()) + " |" for row in result.rows
        ]
        lines += [""]
    write_text(docs / "gallery.md", "\n".join(lines))


if __name__ == "__main__":
    tyro.cli(main)
