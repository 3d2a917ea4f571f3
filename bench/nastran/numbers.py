"""Numbers as Nastran writes them: a field of 8 or 16 characters, and an exponent without its letter.

A real number must hold a decimal point; an integer must not. ``1.2345-4`` is 1.2345e-4; the letters E and D are
accepted on reading. Within the width of a field a number keeps 3 to 7 significant digits (8 characters) or 10 to 15
(16 characters), depending on its sign and exponent: `real_text` takes the notation that loses least.
"""

from __future__ import annotations

import math
import re

from bench.errors import ParameterError

_REAL = re.compile(r"^([+-]?(?:\d+\.\d*|\.\d+))(?:[EeDd]?([+-]\d+)|[EeDd](\d+))?$")
_INTEGER = re.compile(r"^[+-]?\d+$")


def parse_real(text: str) -> float:
    """Read a real number.

    Raises:
        ValueError: The text is no real number; one without a decimal point is an integer to Nastran.
    """
    match = _REAL.match(text)
    if match is None:
        raise ValueError("a real number with a decimal point")
    mantissa, signed, unsigned = match.groups()
    return float(f"{mantissa}e{signed or unsigned or '0'}")


def parse_integer(text: str) -> int:
    """Read an integer.

    Raises:
        ValueError: The text is no integer.
    """
    if (
        _INTEGER.match(text) is None or len(text) > 20
    ):  # Nastran's own have eight digits, in large fields sixteen
        raise ValueError("an integer")
    return int(text)


def integer_text(value: int, width: int) -> str:
    """An integer in at most `width` characters.

    Raises:
        ParameterError: It does not fit.
    """
    text = str(int(value))
    if len(text) > width:
        raise ParameterError(f"the integer {text} does not fit into a field of {width} characters")
    return text


def real_text(value: float, width: int) -> str:
    """A real number in at most `width` characters, in the notation that keeps most of it.

    Args:
        value: A finite number.
        width: 8 or 16; at least 8, which holds one digit of any double.

    Raises:
        ParameterError: The number is not finite.
    """
    if not math.isfinite(value):
        raise ParameterError(f"{value} cannot be written on a card; finite numbers are expected")
    if value == 0.0:
        return "0."
    candidates = [text for text in (_positional(value, width), _exponential(value, width)) if text]
    return min(candidates, key=lambda text: (abs(parse_real(text) - value), len(text)))


def _positional(value: float, width: int) -> str | None:
    for places in range(width - 1, -1, -1):
        text = f"{value:.{places}f}"
        text = text.rstrip("0") if places else text + "."
        text = text.replace("-0.", "-.", 1) if text.startswith("-0.") else text
        text = text[1:] if text.startswith("0.") else text
        if len(text) <= width and any(digit in text for digit in "123456789"):
            return text
    return None


def _exponential(value: float, width: int) -> str | None:
    for digits in range(16, -1, -1):
        mantissa, exponent = f"{value:.{digits}e}".split("e")
        mantissa = mantissa.rstrip("0") if digits else mantissa + "."
        text = f"{mantissa}{int(exponent):+d}"
        if len(text) <= width:
            return text
    return None
