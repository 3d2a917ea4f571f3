"""Typed bulk-data cards: those that a network in a deck is made of; any other card is kept as text.

Each card knows its data fields in Nastran's order (`fields`) and how to read itself from them (`read`). Field numbers
in messages are Nastran's: field 1 holds the card's name, fields 2 to 9 of a line hold data, and a large-field card's
two lines count as one.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Self

from bench.limits import READING_LIMITS
from bench.nastran.raw_card import Card, Field, RawCard


@dataclass(frozen=True)
class OtherCard(Card):
    """A card that this module does not interpret."""

    kind: str
    texts: tuple[str, ...]

    @property
    def name(self) -> str:
        """Name in field 1."""
        return self.kind

    def fields(self) -> list[Field]:
        """The fields as they were read."""
        return [text or None for text in self.texts]


@dataclass(frozen=True)
class ScalarPoints(Card):
    """SPOINT or EPOINT: scalar points, which may carry static loads, or extra points, which may not."""

    ids: tuple[int, ...]
    kind: str = "SPOINT"

    @property
    def name(self) -> str:
        """SPOINT or EPOINT."""
        return self.kind

    def fields(self) -> list[Field]:
        """A range as ``first THRU last``, single points one by one."""
        first, last = self.ids[0], self.ids[-1]
        if len(self.ids) > 1 and self.ids == tuple(range(first, last + 1)):
            return [first, "THRU", last]
        return list(self.ids)

    @classmethod
    def read(cls, raw: RawCard) -> Self:
        """Read either form."""
        if not raw.blank(1) and raw.fields[1].upper() == "THRU":
            first, last = raw.integer(0, "first point"), raw.integer(2, "last point")
            if last < first:
                raise raw.fail(2, "last point", f"a number from {first} on")
            if last - first >= READING_LIMITS.model_items:
                raise raw.fail(2, "last point", f"at most {READING_LIMITS.model_items} points")
            return cls(tuple(range(first, last + 1)), raw.name)
        used = [i for i in range(len(raw.fields)) if not raw.blank(i)] or [0]
        return cls(tuple(raw.integer(i, "point") for i in used), raw.name)


@dataclass(frozen=True)
class Grid(Card):
    """GRID: a point with six components, of which `constrained` are fixed for good."""

    id: int
    position: tuple[float, float, float] = (0.0, 0.0, 0.0)
    constrained: str = ""
    coordinates: int = 0
    NAME: ClassVar[str] = "GRID"

    def fields(self) -> list[Field]:
        """ID, CP, X1, X2, X3, CD, PS."""
        fixed = int(self.constrained) if self.constrained else None
        return [self.id, self.coordinates, *self.position, 0, fixed]

    @classmethod
    def read(cls, raw: RawCard) -> Self:
        """Read a grid point; displacement coordinates and superelement are not kept."""
        x, y, z = (raw.real(2 + i, f"X{i + 1}", 0.0) for i in range(3))
        fixed = raw.integer(6, "constrained components", 0)
        if fixed and not set(str(fixed)) <= set("123456"):
            raise raw.fail(6, "constrained components", "digits from 1 to 6")
        return cls(raw.integer(0, "point"), (x, y, z), str(fixed or ""), raw.integer(1, "CP", 0))


@dataclass(frozen=True)
class Mpc(Card):
    """MPC: a linear relation ``sum(coefficient * u(point, component)) = 0``; the first term is the dependent one."""

    sid: int
    terms: tuple[tuple[int, int, float], ...]
    NAME: ClassVar[str] = "MPC"

    def fields(self) -> list[Field]:
        """SID, then two terms a line, with a blank field before and after them."""
        out: list[Field] = [self.sid]
        for i, term in enumerate(self.terms):
            out += [*term] if i % 2 == 0 else [*term, None, None]
        return out

    @classmethod
    def read(cls, raw: RawCard) -> Self:
        """Read all terms."""
        terms = []
        for start in range(0, max(len(raw.fields), 1), 8):
            for at in (start + 1, start + 4):
                if at == 1 or not all(raw.blank(i) for i in range(at, at + 3)):
                    terms.append(
                        (
                            raw.integer(at, "point"),
                            raw.integer(at + 1, "component", 0),
                            raw.real(at + 2, "coefficient"),
                        )
                    )
        return cls(raw.integer(0, "set"), tuple(terms))


@dataclass(frozen=True)
class Sload(Card):
    """SLOAD: static loads on one to three scalar points."""

    sid: int
    loads: tuple[tuple[int, float], ...]
    NAME: ClassVar[str] = "SLOAD"

    def fields(self) -> list[Field]:
        """SID, then point and load in turn."""
        return [self.sid, *(item for load in self.loads for item in load)]

    @classmethod
    def read(cls, raw: RawCard) -> Self:
        """Read up to three loads."""
        loads = [
            (raw.integer(i, "point"), raw.real(i + 1, "load"))
            for i in (1, 3, 5)
            if i == 1 or not (raw.blank(i) and raw.blank(i + 1))
        ]
        return cls(raw.integer(0, "set"), tuple(loads))


@dataclass(frozen=True)
class DmigHeader(Card):
    """DMIG, header: form 1 square, 2 rectangular, 6 symmetric; types 1 and 2 real, 3 and 4 complex."""

    matrix: str
    form: int = 1
    type_in: int = 1
    type_out: int = 0
    NAME: ClassVar[str] = "DMIG"

    def fields(self) -> list[Field]:
        """NAME, 0, IFO, TIN, TOUT."""
        return [self.matrix, 0, self.form, self.type_in, self.type_out]

    @classmethod
    def read(cls, raw: RawCard) -> Self:
        """Read the header of a real matrix."""
        type_in = raw.integer(3, "TIN")
        if type_in not in (1, 2):
            raise raw.fail(3, "TIN", "1 or 2 (a real matrix)")
        return cls(raw.text(0, "matrix"), raw.integer(2, "IFO"), type_in, raw.integer(4, "TOUT", 0))


@dataclass(frozen=True)
class DmigColumn(Card):
    """DMIG, column or a part of one: the terms ``(point, component, value)`` in the column of a point's component."""

    matrix: str
    point: int
    component: int
    terms: tuple[tuple[int, int, float], ...]
    NAME: ClassVar[str] = "DMIG"

    def fields(self) -> list[Field]:
        """NAME, GJ, CJ, blank, then G, C, A, blank for each term."""
        out: list[Field] = [self.matrix, self.point, self.component, None]
        for term in self.terms:
            out += [*term, None]
        return out

    @classmethod
    def read(cls, raw: RawCard) -> Self:
        """Read all terms; component 1 and 0 both name a scalar point's only one and are kept as they stand."""
        terms = [
            (raw.integer(i, "row point"), raw.integer(i + 1, "row component", 0), raw.real(i + 2, "value"))
            for i in range(4, max(len(raw.fields), 5), 4)
            if i == 4 or not all(raw.blank(j) for j in range(i, i + 3))
        ]
        return cls(
            raw.text(0, "matrix"),
            raw.integer(1, "column point"),
            raw.integer(2, "column component", 0),
            tuple(terms),
        )


@dataclass(frozen=True)
class Nolin1(Card):
    """NOLIN1: load ``scale * T(u)`` on a point's component, u the displacement of another (component + 10: velocity)."""

    sid: int
    loaded: int
    loaded_component: int
    scale: float
    read_from: int
    read_component: int
    table: int
    NAME: ClassVar[str] = "NOLIN1"

    def fields(self) -> list[Field]:
        """SID, GI, CI, S, GJ, CJ, TID."""
        return [
            self.sid,
            self.loaded,
            self.loaded_component,
            self.scale,
            self.read_from,
            self.read_component,
            self.table,
        ]

    @classmethod
    def read(cls, raw: RawCard) -> Self:
        """Read a nonlinear load."""
        return cls(
            raw.integer(0, "set"),
            raw.integer(1, "GI"),
            raw.integer(2, "CI", 0),
            raw.real(3, "scale"),
            raw.integer(4, "GJ"),
            raw.integer(5, "CJ", 0),
            raw.integer(6, "table"),
        )


@dataclass(frozen=True)
class Tabled1(Card):
    """TABLED1: a piecewise linear function, continued by its first and last straight line."""

    id: int
    points: tuple[tuple[float, float], ...]
    NAME: ClassVar[str] = "TABLED1"

    def fields(self) -> list[Field]:
        """TID, seven blanks, then x and y in turn, then ENDT."""
        return [self.id, *[None] * 7, *(item for point in self.points for item in point), "ENDT"]

    @classmethod
    def read(cls, raw: RawCard) -> Self:
        """Read a table with linear axes, up to ENDT."""
        for i, axis in ((1, "x axis"), (2, "y axis")):
            if raw.text(i, axis, "LINEAR") != "LINEAR":
                raise raw.fail(i, axis, "LINEAR or blank")
        points = []
        for i in range(8, len(raw.fields), 2):
            words = [raw.fields[j].upper() if not raw.blank(j) else "" for j in (i, i + 1)]
            if words[0] == "ENDT":
                break
            if any(words) and "SKIP" not in words:
                points.append((raw.real(i, "x"), raw.real(i + 1, "y")))
        else:
            raise raw.fail(len(raw.fields), "end of table", "ENDT")
        if len(points) < 2:
            raise raw.fail(8, "x", "at least two points")
        return cls(raw.integer(0, "table"), tuple(points))


@dataclass(frozen=True)
class Lseq(Card):
    """LSEQ: makes the static load set `load` a dynamic one that TLOAD1 knows by `excitation`."""

    sid: int
    excitation: int
    load: int
    NAME: ClassVar[str] = "LSEQ"

    def fields(self) -> list[Field]:
        """SID, DAREA, LID."""
        return [self.sid, self.excitation, self.load]

    @classmethod
    def read(cls, raw: RawCard) -> Self:
        """Read a load sequence."""
        return cls(*(raw.integer(i, what) for i, what in enumerate(("set", "excitation", "load set"))))


@dataclass(frozen=True)
class Tload1(Card):
    """TLOAD1: the loads of `excitation` times a table of time."""

    sid: int
    excitation: int
    table: int
    NAME: ClassVar[str] = "TLOAD1"

    def fields(self) -> list[Field]:
        """SID, EXCITEID, DELAY, TYPE, TID."""
        return [self.sid, self.excitation, None, None, self.table]

    @classmethod
    def read(cls, raw: RawCard) -> Self:
        """Read a force load without delay."""
        if not raw.blank(2) and raw.fields[2].strip("0. "):
            raise raw.fail(2, "DELAY", "blank or zero")
        if raw.integer(3, "TYPE", 0) != 0:
            raise raw.fail(3, "TYPE", "blank or 0 (a force)")
        return cls(raw.integer(0, "set"), raw.integer(1, "excitation"), raw.integer(4, "table"))
