"""Make the pages of the documentation that come from the code: laws, effects, environments, commands, documents.

Run it after changing one of these::

    python scripts/docs.py            # pages and pictures
    python scripts/docs.py --check    # says which pages are out of date, and writes nothing
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

import tyro
from documentation import effects, interfaces, laws

from bench.files import write_text

DOCS = Path(__file__).resolve().parent.parent / "docs"


@dataclass(frozen=True)
class Args:
    """Make the pages that come from the code.

    Attributes:
        check: Only say which pages are out of date; the exit status is then 1.
        pictures: Draw the pictures, too.
    """

    check: bool = False
    pictures: bool = True


def pages() -> dict[str, str]:
    """All generated pages, by path below docs/."""
    return (
        laws.pages()
        | effects.pages()
        | interfaces.environments()
        | interfaces.commands()
        | interfaces.documents()
    )


def stale(made: dict[str, str], docs: Path = DOCS) -> list[str]:
    """Paths of pages that differ from what the code says, of missing ones, and of those that nothing makes any more.

    Args:
        made: The pages as the code makes them.
        docs: The folder of the documentation.
    """
    old = [
        path
        for path, text in made.items()
        if not (docs / path).is_file() or (docs / path).read_text("utf-8") != text
    ]
    folders = ("laws", "effects", "environments")
    kept = [
        p.relative_to(docs).as_posix()
        for folder in folders
        for p in (docs / "reference" / folder).glob("*.md")
    ]
    return sorted([*old, *(path for path in kept if path not in made)])


def main(args: Args) -> int:
    """Write or check."""
    made = pages()
    old = stale(made)
    if args.check:
        for path in old:
            print(f"out of date: docs/{path}")
        return 1 if old else 0
    for path in old:
        text = made.get(path)
        if text is None:
            (DOCS / path).unlink()
            continue
        (DOCS / path).parent.mkdir(parents=True, exist_ok=True)
        write_text(DOCS / path, text)
    if args.pictures:
        laws.draw_all(DOCS)
        effects.draw_all(DOCS)
    return 0


if __name__ == "__main__":
    sys.exit(main(tyro.cli(Args)))
