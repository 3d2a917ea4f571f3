"""Run the examples of README and docs, page by page, the slow ones included.

python scripts/snippets.py                    # all
python scripts/snippets.py docs/ten-tasks.md  # a page
"""

from __future__ import annotations

import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import tyro
from documentation import snippets


@dataclass(frozen=True)
class Args:
    """Run the examples of README and docs.

    Attributes:
        pages: Pages; all where none is given.
    """

    pages: tyro.conf.Positional[tuple[Path, ...]] = ()


def main(args: Args) -> int:
    """Run them."""
    failed = 0
    for page in args.pages or snippets.pages():
        with tempfile.TemporaryDirectory() as folder:
            try:
                count = snippets.run_page(page.resolve(), Path(folder), slow=True)
            except ValueError as error:
                failed += 1
                print(error, file=sys.stderr)
                continue
        if count:
            print(f"{page}: {count} run")
    return min(failed, 1)


if __name__ == "__main__":
    sys.exit(main(tyro.cli(Args)))
