"""What a MATLAB file of version 4 to 7.2 claims, summed up before scipy reads it.

scipy's compiled reader takes memory for the shapes that a file states and calls itself for every level of nesting; here the tags of
the file are walked, without their values, so that a shape that no bytes stand behind, a compressed element that unpacks to gigabytes
or a thousand cells within cells are refused in time.

References:
    The MathWorks, MAT-File Format (R2024b), tables 1-1 to 1-3: tags, array flags, compressed elements.
"""

from __future__ import annotations

import contextlib
import math
import struct
import zlib
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from bench.errors import FileFormatError
from bench.limits import ReadingLimits, size_text


@dataclass(frozen=True)
class MatClaimsSettings:
    """Numbers of `bench.record_files.mat_claims`."""

    matrix: int = 14
    compressed: int = 15
    cell: int = 1
    struct: int = 2
    object: int = 3
    char: int = 4
    sparse: int = 5
    last: int = 15
    complex: int = 0x0800
    numeric: frozenset[int] = frozenset((1, 2, 3, 4, 5, 6, 7, 9, 12, 13))
    texts: frozenset[int] = numeric | {16, 17, 18}
    """Types of data; scipy takes others for pointers."""
    step: int = 2**20


SETTINGS = MatClaimsSettings()


class _Budget:
    """What is left of the limits."""

    def __init__(self, path: Path, limits: ReadingLimits) -> None:
        self.path, self.limits = path, limits
        self.bytes, self.objects = 8 * limits.numbers, limits.objects

    def unpacked(self, n: int) -> None:
        self.bytes -= n
        if self.bytes < 0:
            raise FileFormatError(
                f"'{self.path}' unpacks to more than {size_text(8 * self.limits.numbers)}, which is the most that is read; if that is "
                "no damage, cut the file into parts"
            )

    def opened(self, depth: int) -> None:
        self.objects -= 1
        if self.objects < 0 or depth > self.limits.depth:
            raise FileFormatError(
                f"'{self.path}' holds more than {self.limits.objects} arrays, or structures nested more than {self.limits.depth} deep, "
                "which are not read; save the channels as plain arrays"
            )


class _Unread(Exception):
    """A function handle or an object of a class of the user's: nothing that a channel could be."""


class _Tag(NamedTuple):
    """Head of an element."""

    kind: int
    size: int
    data: int
    """Where its data begin."""
    following: int
    """Where the next element begins."""


def check_claims(path: Path, limits: ReadingLimits) -> list[str] | None:
    """Walk the file's tags.

    Returns:
        Names of the variables that may be read; None for all.

    Args:
        path: Path of the file.
        limits: What it may cost.

    Raises:
        FileFormatError: It claims more than the limits allow.
        ValueError: It claims more than it holds.
    """
    if path.stat().st_size > 8 * limits.numbers:
        raise FileFormatError(
            f"'{path}' has {size_text(path.stat().st_size)}, and {size_text(8 * limits.numbers)} is the most that is read; cut it"
        )
    content = memoryview(path.read_bytes())
    if len(content) < 4 or 0 in content[:4]:
        _check_version_4(content, _Budget(path, limits))
        return None
    if len(content) < 128 or content[126:128] not in (b"IM", b"MI"):
        raise ValueError("its first 128 bytes are no header of a MATLAB file")
    order = "<" if content[126:128] == b"IM" else ">"
    if content[125 if order == "<" else 124] != 1:  # version 7.3, of which scipy speaks
        return None
    budget = _Budget(path, limits)
    budget.unpacked(len(content))
    at = 128
    names: list[str] = []
    while at + 8 <= len(content):
        kind, size = struct.unpack_from(order + "II", content, at)
        at += 8
        data = content[at : at + size]
        if kind == SETTINGS.compressed:
            data = _unpacked(data, budget)
            if len(data) >= 8:
                kind, length = struct.unpack_from(order + "II", data, 0)
                data = data[8 : 8 + length]
        if kind == SETTINGS.matrix:
            with contextlib.suppress(_Unread):
                names.append(_check_matrix(data, order, budget, 1))
        at += size
    return names


def _unpacked(data: memoryview, budget: _Budget) -> memoryview:
    """A compressed element, unpacked no further than the budget goes."""
    decoder = zlib.decompressobj()
    parts = []
    rest: bytes | memoryview = data
    while rest and not decoder.eof:
        part = decoder.decompress(rest, SETTINGS.step)
        rest = decoder.unconsumed_tail
        budget.unpacked(len(part))
        parts.append(part)
        if not part and not rest:
            break
    return memoryview(b"".join(parts))


def _check_matrix(data: memoryview, order: str, budget: _Budget, depth: int) -> str:
    """One array: flags, shape, name, and what its class asks for; gives the name."""
    budget.opened(depth)
    if not data:
        return ""
    flags = _tag(data, 0, order)
    if flags.size < 4 or flags.data + 4 > len(data):
        raise ValueError("an array has no flags")
    word = struct.unpack_from(order + "I", data, flags.data)[0]
    kind, parts = word & 0xFF, 2 if word & SETTINGS.complex else 1
    shape_tag = _tag(data, flags.following, order)
    if not 0 < kind <= SETTINGS.last:  # function handles and opaque objects, which have no shape
        raise _Unread
    count = min(shape_tag.size // 4, 64)
    shape = struct.unpack_from(f"{order}{count}i", data, shape_tag.data)
    if any(n < 0 for n in shape):
        raise ValueError(f"an array has shape {shape}")
    n = math.prod(shape)
    if kind != SETTINGS.sparse and n > max(
        len(data), 1
    ):  # a sparse array's shape says nothing about its size
        raise ValueError(f"an array claims {n} values in {len(data)} bytes")
    name = _tag(data, shape_tag.following, order)
    at = name.following
    if kind in (SETTINGS.struct, SETTINGS.object):
        at, fields = _fields(data, at, order, named=kind == SETTINGS.object)
        n *= fields
        if n > len(data):
            raise ValueError(f"a structure claims {n} fields in {len(data)} bytes")
    if kind in (SETTINGS.cell, SETTINGS.struct, SETTINGS.object):
        _check_arrays(data, at, order, n, budget, depth)
    else:
        _check_values(
            data,
            at,
            order,
            [SETTINGS.texts]
            if kind == SETTINGS.char
            else [SETTINGS.numeric] * (parts + 2 * (kind == SETTINGS.sparse)),
        )
    return bytes(data[name.data : name.data + name.size]).decode("latin-1").rstrip("\0")


def _fields(data: memoryview, at: int, order: str, *, named: bool) -> tuple[int, int]:
    """Where the fields of a structure begin, and how many names they have; an object has the name of its class before."""
    if named:
        at = _tag(data, at, order).following
    length_tag = _tag(data, at, order)
    length = struct.unpack_from(order + "i", data, length_tag.data)[0] if length_tag.size >= 4 else 0
    names = _tag(data, length_tag.following, order)
    if length <= 0 or names.size > len(data):
        raise ValueError("a structure has field names of no length")
    return names.following, names.size // length


def _check_arrays(data: memoryview, at: int, order: str, n: int, budget: _Budget, depth: int) -> None:
    """The arrays within a cell or structure."""
    for _ in range(n):
        if at + 8 > len(data):
            break
        inner = _tag(data, at, order)
        if inner.kind != SETTINGS.matrix:
            raise ValueError(f"an element of type {inner.kind} stands where an array is expected")
        _check_matrix(data[inner.data : inner.data + inner.size], order, budget, depth + 1)
        at = inner.following


def _check_values(data: memoryview, at: int, order: str, kinds: list[frozenset[int]]) -> None:
    """The parts of an array of numbers or text are of types that there are."""
    for known in kinds:
        tag = _tag(data, at, order)
        if tag.kind not in known:
            raise ValueError(f"values of type {tag.kind}, which there is none")
        at = tag.following


def _tag(data: memoryview, at: int, order: str) -> _Tag:
    """The tag at a place, of the long form or, for at most four bytes of data, the short one."""
    if at + 8 > len(data):
        raise ValueError("an array ends before its data do")
    first, second = struct.unpack_from(order + "II", data, at)
    if first >> 16:
        return _Tag(first & 0xFFFF, first >> 16, at + 4, at + 8)
    return _Tag(first, second, at + 8, at + 8 + second + (-second % 8))


def _check_version_4(content: memoryview, budget: _Budget) -> None:
    """Arrays of version 4: 20 bytes of head, the name, then the values."""
    at = 0
    while at + 20 <= len(content):
        for order in "<>":
            code, rows, columns, imaginary, name = struct.unpack_from(order + "5i", content, at)
            if 0 <= code <= 5000:
                break
        else:
            raise ValueError("its first bytes are no header of a MATLAB file")
        width = (8, 4, 4, 2, 2, 1)[min(code // 10 % 10, 5)]
        size = rows * columns * width * (2 if imaginary else 1)
        budget.opened(1)
        if min(rows, columns, name) < 0 or name > 1000 or size > len(content) - at:
            raise ValueError(f"an array claims {rows} x {columns} values in {len(content) - at} bytes")
        at += 20 + name + size
    budget.unpacked(len(content))
