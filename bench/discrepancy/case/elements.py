"""What a ``nominal.json`` says of laws of the bench that are parts of its model: entry ``"elements"``, a list of such::

    {"law": "jenkins", "name": "slip", "place": "guide",
     "parameters": {"limit": {"value": 6100, "std": 610}, "stiffness": {"value": 2.2e6, "std": 2e5}, "transition": 0.1}}

``place`` is a joint or fixed tendon of the user's MJCF, or a place of one of the bench's rigs, and may be left out where there is one.
A parameter given as an object is a nominal parameter like any other, called "slip.limit"; what is a plain number is exact, and
what is left out has the default of the law.
"""

from __future__ import annotations

import math
from typing import Any

from bench.errors import FileFormatError, UnknownNameError
from bench.laws import LAWS, ForceLaw

ENTRIES = ("law", "name", "place", "parameters")
"""Entries of an element."""
PARAMETER = ("value", "std", "unit")
"""Entries of an uncertain parameter of one."""


def declared_parameters(elements: Any, path: object) -> dict[str, tuple[float, float, str]]:
    """Nominal parameters that the elements of a ``nominal.json`` add, name by name: value, one-sigma uncertainty, unit.

    Raises:
        FileFormatError: An element is not of the form expected.
        UnknownNameError: Its law, or a parameter of it, is none.
    """
    if not isinstance(elements, list | tuple):
        raise FileFormatError(f"'{path}': elements is {elements!r}; a list of objects with a law is expected")
    out: dict[str, tuple[float, float, str]] = {}
    names: set[str] = set()
    for element in elements:
        law, name = law_of(element, path)
        if name in names:
            raise FileFormatError(f"'{path}' has two elements called '{name}'; give each a name of its own")
        names.add(name)
        for parameter, entry in element.get("parameters", {}).items():
            if parameter not in law.parameter_names:
                raise UnknownNameError(
                    f"parameter of the element '{name}' (law {law.name})", parameter, law.parameter_names
                )
            if isinstance(entry, dict):
                out[f"{name}.{parameter}"] = _uncertain(
                    entry, f"'{path}': '{parameter}' of the element '{name}'"
                )
            elif not _is_number(entry):
                raise FileFormatError(
                    f"'{path}': '{parameter}' of the element '{name}' is {entry!r}; a number, or an object with value and std, is expected"
                )
    return out


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def _uncertain(entry: dict[str, Any], what: str) -> tuple[float, float, str]:
    """Value, uncertainty and unit of a parameter."""
    for key in entry:
        if key not in PARAMETER:
            raise UnknownNameError(f"entry of {what}", str(key), PARAMETER)
    value, std, unit = entry.get("value"), entry.get("std"), entry.get("unit", "")
    if isinstance(unit, str) and _is_number(value) and _is_number(std):
        number, spread = float(value or 0.0), float(std or 0.0)
        if spread >= 0.0:
            return number, spread, unit
    raise FileFormatError(
        f"{what} is {entry!r}; a value and its one-sigma std (0 to mean certain) are expected"
    )


def law_of(element: Any, path: object) -> tuple[ForceLaw, str]:
    """Law and name of an element."""
    if not isinstance(element, dict) or not isinstance(element.get("law"), str):
        raise FileFormatError(f"'{path}': an element is {element!r}; an object with a 'law' is expected")
    for entry in element:
        if entry not in ENTRIES:
            raise UnknownNameError(f"entry of the element '{element['law']}'", entry, ENTRIES)
    if not isinstance(element.get("parameters", {}), dict):
        raise FileFormatError(
            f"'{path}': parameters of '{element['law']}' is no object; name by name is expected"
        )
    single = {name: law for name, law in LAWS.items() if law.n_coordinates == 1}
    if element["law"] not in single:
        raise UnknownNameError("law of one coordinate", element["law"], single)
    return single[element["law"]], str(element.get("name", element["law"]))
