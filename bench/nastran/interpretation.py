"""Which card a name stands for."""

from __future__ import annotations

from collections.abc import Callable

from bench.nastran.cards import (
    DmigColumn,
    DmigHeader,
    Grid,
    Lseq,
    Mpc,
    Nolin1,
    OtherCard,
    ScalarPoints,
    Sload,
    Tabled1,
    Tload1,
)
from bench.nastran.raw_card import Card, RawCard
from bench.nastran.structure_cards import Cbar, Conm2, Mat1, Nolin2, Pbar, ScalarElement, Spc


def _read_dmig(raw: RawCard) -> Card:
    column = raw.integer(1, "column point (0: header)")
    return DmigHeader.read(raw) if column == 0 else DmigColumn.read(raw)


_READERS: dict[str, Callable[[RawCard], Card]] = {
    "SPOINT": ScalarPoints.read,
    "EPOINT": ScalarPoints.read,
    "GRID": Grid.read,
    "MPC": Mpc.read,
    "SPC": Spc.read,
    "SLOAD": Sload.read,
    "DMIG": _read_dmig,
    "NOLIN1": Nolin1.read,
    "NOLIN2": Nolin2.read,
    "TABLED1": Tabled1.read,
    "LSEQ": Lseq.read,
    "TLOAD1": Tload1.read,
    "CELAS2": ScalarElement.read,
    "CDAMP2": ScalarElement.read,
    "CBAR": Cbar.read,
    "PBAR": Pbar.read,
    "MAT1": Mat1.read,
    "CONM2": Conm2.read,
}


def interpret(raw: RawCard) -> Card:
    """The typed card of a raw one; `OtherCard` where the name is none of those above.

    Raises:
        FileFormatError: A field does not hold what it should; names place, card, field and what was expected.
    """
    reader = _READERS.get(raw.name)
    return OtherCard(raw.name, raw.fields) if reader is None else reader(raw)
