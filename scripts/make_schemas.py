"""Writes the JSON Schemas that the package ships, from the models of the documents."""

from __future__ import annotations

from bench.cli.schema import FOLDER, KINDS, generated, text_of
from bench.files import write_text


def main() -> None:
    """Write all of them."""
    for name in KINDS:
        write_text(FOLDER / f"{name}.json", text_of(generated(name)))
        print(FOLDER / f"{name}.json")


if __name__ == "__main__":
    main()
