"""Typed cards of a structure: scalar springs and dampers, bars, masses, fixed components, and products as nonlinear loads.

They are those of the deck of appendix B.1 in Tasbihgoo 2006. Constants of these cards that such a deck leaves blank (shear, stress
recovery, offsets, thermal expansion) are passed over in reading.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Self

from bench.nastran.cards import Field
from bench.nastran.raw_card import Card, RawCard


@dataclass(frozen=True)
class ScalarElement(Card):
    """CELAS2 or CDAMP2: a spring or a damper between two components, or between one and the ground (point 0)."""

    id: int
    value: float
    first: tuple[int, int]
    second: tuple[int, int] = (0, 0)
    kind: str = "CELAS2"

    @property
    def name(self) -> str:
        """CELAS2 or CDAMP2."""
        return self.kind

    def fields(self) -> list[Field]:
        """EID, K or B, G1, C1, G2, C2."""
        other: list[Field] = [*self.second] if self.second != (0, 0) else []
        return [self.id, self.value, *self.first, *other]

    @classmethod
    def read(cls, raw: RawCard) -> Self:
        """Read a spring or a damper; structural damping of a spring must be zero."""
        if raw.name == "CELAS2" and raw.real(6, "GE", 0.0) != 0.0:
            raise raw.fail(6, "GE", "blank or 0. (no structural damping)")
        points = [(raw.integer(i, f"G{k}", 0), raw.integer(i + 1, f"C{k}", 0)) for i, k in ((2, 1), (4, 2))]
        if points[0][0] == 0:
            points.reverse()
        return cls(
            raw.integer(0, "element"), raw.real(1, "stiffness or damping"), points[0], points[1], raw.name
        )


@dataclass(frozen=True)
class Cbar(Card):
    """CBAR: a bar between two grids; `pins` are the components released at either end, "14" for axial force and torque."""

    id: int
    section: int
    ends: tuple[int, int]
    orientation: tuple[float, float, float] = (0.0, 1.0, 0.0)
    pins: tuple[str, str] = ("", "")
    NAME: ClassVar[str] = "CBAR"

    def fields(self) -> list[Field]:
        """EID, PID, GA, GB, X1, X2, X3, blank, then the pins."""
        pins = [int(pin) if pin else None for pin in self.pins]
        return [self.id, self.section, *self.ends, *self.orientation, None, *pins]

    @classmethod
    def read(cls, raw: RawCard) -> Self:
        """Read a bar whose orientation is given as a vector; the pins may stand on the continuation or, as printed, after it."""
        x, y, z = (raw.real(4 + i, f"X{i + 1}", 0.0) for i in range(3))
        pins = [raw.integer(i, f"P{k}", 0) for i, k in ((8, "A"), (9, "B"))]
        for pin, i in zip(pins, (8, 9), strict=True):
            if pin and not set(str(pin)) <= set("123456"):
                raise raw.fail(i, "pins", "digits from 1 to 6")
        ends = (raw.integer(2, "GA"), raw.integer(3, "GB"))
        texts = (str(pins[0] or ""), str(pins[1] or ""))
        return cls(
            raw.integer(0, "element"),
            raw.integer(1, "PID", raw.integer(0, "element")),
            ends,
            (x, y, z),
            texts,
        )

    @property
    def carries(self) -> tuple[bool, bool]:
        """Whether it carries axial force and torque."""
        axial, torque = ((digit not in self.pins[0] and digit not in self.pins[1]) for digit in "14")
        return axial, torque


@dataclass(frozen=True)
class Pbar(Card):
    """PBAR: area, moments of inertia and torsional constant of a bar."""

    id: int
    material: int
    area: float
    bending: tuple[float, float] = (0.0, 0.0)
    torsion: float = 0.0
    NAME: ClassVar[str] = "PBAR"

    def fields(self) -> list[Field]:
        """PID, MID, A, I1, I2, J."""
        return [self.id, self.material, self.area, *self.bending, self.torsion]

    @classmethod
    def read(cls, raw: RawCard) -> Self:
        """Read a bar's section."""
        area, i1, i2, j = (raw.real(2 + k, name, 0.0) for k, name in enumerate(("A", "I1", "I2", "J")))
        return cls(raw.integer(0, "property"), raw.integer(1, "material"), area, (i1, i2), j)


@dataclass(frozen=True)
class Mat1(Card):
    """MAT1: a material's modulus and its Poisson ratio; the shear modulus follows where it is blank."""

    id: int
    modulus: float
    poisson: float = 0.0
    shear: float | None = None
    NAME: ClassVar[str] = "MAT1"

    def fields(self) -> list[Field]:
        """MID, E, G, NU."""
        return [self.id, self.modulus, self.shear, self.poisson]

    @classmethod
    def read(cls, raw: RawCard) -> Self:
        """Read a material. ``MAT1 1 2.9E+7 0.32`` as printed leaves out the blank of G: a G below 1 is taken for the ratio."""
        shear = None if raw.blank(2) else raw.real(2, "G")
        poisson = raw.real(3, "NU", 0.0)
        if shear is not None and shear < 1.0 and raw.blank(3):
            shear, poisson = None, shear
        return cls(raw.integer(0, "material"), raw.real(1, "E"), poisson, shear)

    @property
    def shear_modulus(self) -> float:
        """G, ``E / (2 (1 + ν))`` where it is not given."""
        return self.modulus / (2.0 * (1.0 + self.poisson)) if self.shear is None else self.shear


@dataclass(frozen=True)
class Conm2(Card):
    """CONM2: a mass at a grid, with its inertia about the grid's first axis."""

    id: int
    grid: int
    mass: float
    inertia: float = 0.0
    NAME: ClassVar[str] = "CONM2"

    def fields(self) -> list[Field]:
        """EID, G, CID, M, X1, X2, X3, blank, then I11."""
        return [self.id, self.grid, 0, self.mass, 0.0, 0.0, 0.0, None, self.inertia]

    @classmethod
    def read(cls, raw: RawCard) -> Self:
        """Read a mass without offset."""
        for i in (4, 5, 6):
            if raw.real(i, f"X{i - 3}", 0.0) != 0.0:
                raise raw.fail(i, f"X{i - 3}", "blank or 0. (no offset)")
        return cls(
            raw.integer(0, "element"), raw.integer(1, "grid"), raw.real(3, "mass"), raw.real(8, "I11", 0.0)
        )


@dataclass(frozen=True)
class Spc(Card):
    """SPC: components of a grid that are held."""

    sid: int
    grid: int
    components: str
    NAME: ClassVar[str] = "SPC"

    def fields(self) -> list[Field]:
        """SID, G1, C1, D1."""
        return [self.sid, self.grid, int(self.components), 0.0]

    @classmethod
    def read(cls, raw: RawCard) -> Self:
        """Read one held grid; enforced displacements are refused."""
        if raw.real(3, "D1", 0.0) != 0.0:
            raise raw.fail(3, "D1", "blank or 0. (held, not moved)")
        return cls(raw.integer(0, "set"), raw.integer(1, "grid"), str(raw.integer(2, "components")))


@dataclass(frozen=True)
class Nolin2(Card):
    """NOLIN2: load ``scale * u1 * u2`` on a point's component, from two others (component + 10: velocity)."""

    sid: int
    loaded: int
    loaded_component: int
    scale: float
    first: tuple[int, int]
    second: tuple[int, int]
    NAME: ClassVar[str] = "NOLIN2"

    def fields(self) -> list[Field]:
        """SID, GI, CI, S, GJ, CJ, GK, CK."""
        return [self.sid, self.loaded, self.loaded_component, self.scale, *self.first, *self.second]

    @classmethod
    def read(cls, raw: RawCard) -> Self:
        """Read a product."""
        factors = [(raw.integer(i, f"G{k}"), raw.integer(i + 1, f"C{k}", 0)) for i, k in ((4, "J"), (6, "K"))]
        loaded = raw.integer(1, "GI"), raw.integer(2, "CI", 0)
        return cls(raw.integer(0, "set"), *loaded, raw.real(3, "scale"), factors[0], factors[1])
