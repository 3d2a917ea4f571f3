"""The dissertation, figure by figure: every system simulated on the bench's rigs, its tables beside the printed ones.

`reproduce` makes the items asked for and writes them; `ENTRIES` lists them. Each item is one module with a function
``run(progress) -> Item`` that uses the bench as any user would: rigs, signals, identification, figures.
"""

from bench.reproduction.item import Item, Picture, Result
from bench.reproduction.registry import ENTRIES, ItemEntry, find_entries
from bench.reproduction.running import Reproduction, fingerprint, reproduce
from bench.reproduction.verdict import Row, RowVerdict

__all__ = [
    "ENTRIES",
    "Item",
    "ItemEntry",
    "Picture",
    "Reproduction",
    "Result",
    "Row",
    "RowVerdict",
    "find_entries",
    "fingerprint",
    "reproduce",
]
