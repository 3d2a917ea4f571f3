"""Models read off frozen dataclasses, so that no field of what travels is described twice."""

from __future__ import annotations

import inspect
import types
from collections.abc import Callable, Collection, Mapping
from dataclasses import MISSING, fields, is_dataclass
from types import MappingProxyType
from typing import Annotated, Any, ForwardRef, Literal, Union, get_args, get_origin, get_type_hints

import numpy as np
from pydantic import Field, Strict, create_model
from pydantic_core import PydanticUndefined

from bench.documents.kinds import Flag, Listed, Number, Text, Whole, any_of
from bench.documents.model import Entry

SCALARS: Mapping[Any, Any] = {float: Number, int: Whole, bool: Flag, str: Text}
"""Kind of value by the type of a field."""

Own = Callable[[Any], Any]
"""Gives the kind of a field whose annotation it knows, None for the others."""


def entry_of(
    described: type[Any],
    own: Own,
    *,
    kind: str,
    name: str = "",
    base: type[Entry] = Entry,
    replaced: Mapping[str, Any] = MappingProxyType({}),
    needed: Collection[str] | None = None,
    **more: Any,
) -> type[Entry]:
    """The model of a dataclass.

    Args:
        described: The dataclass; its docstring describes the fields.
        own: Kinds of annotations that stand for something else here.
        kind: As `Entry.entry_name`.
        name: Name of the model; that of the class by default.
        base: Base of the model.
        replaced: Kinds of single fields by their names.
        needed: Fields that may not be left out; those without a default where None.
        **more: Fields besides, as pydantic's `create_model` takes them; they come first.
    """
    hints, texts = get_type_hints(described), attributes_of(described)
    entries: dict[str, Any] = dict(more)
    for field in fields(described):
        default: Any = PydanticUndefined
        if field.default is not MISSING:
            default = field.default
        elif field.default_factory is not MISSING:
            default = field.default_factory()
        elif needed is not None and field.name not in needed:
            default = None
        entries[field.name] = (
            replaced.get(field.name) or kind_of(hints[field.name], own, field.name),
            Field(default, description=texts.get(field.name) or field.metadata.get("meaning")),
        )
    model = create_model(name or described.__name__, __base__=base, __module__=__name__, **entries)
    model.entry_name = kind
    return model


def kind_of(hint: Any, own: Own, name: str = "") -> Any:
    """The kind of value that an annotation stands for.

    Args:
        hint: The annotation of a dataclass's field.
        own: See `entry_of`.
        name: Name of the field, for dataclasses within it.
    """
    found = own(hint)
    if found is not None:
        return ForwardRef(found) if isinstance(found, str) else found
    if hint in SCALARS:
        return SCALARS[hint]
    origin, arguments = get_origin(hint), get_args(hint)
    alias = getattr(origin, "__value__", None)
    if alias is not None:  # an alias by Python's `type` statement, as NDArray from numpy 2.5 on
        return kind_of(alias[arguments], own, name)
    if hint in (Any, type(None)) or origin is Literal:
        return hint
    if is_dataclass(hint):
        return entry_of(hint, own, kind=f"an entry of {name or 'the list'}")
    if origin in {types.UnionType, Union}:
        return any_of(*(kind_of(argument, own, name) for argument in arguments))
    if origin is np.ndarray or hint is np.ndarray:
        return Listed[Number]
    if origin is tuple:
        inner = [kind_of(argument, own, name) for argument in arguments if argument is not Ellipsis]
        return Listed[inner[0]] if Ellipsis in arguments else Annotated[tuple[tuple(inner)], Strict(False)]
    if origin is dict:
        return dict[kind_of(arguments[0], own), kind_of(arguments[1], own, name)]
    raise TypeError(f"no kind of value for the annotation {hint!r}")


def first_line(described: type[Any]) -> str:
    """The first line of a docstring."""
    return (described.__doc__ or "").strip().splitlines()[0]


def attributes_of(described: type[Any]) -> dict[str, str]:
    """The description of each attribute in a Google-style docstring."""
    found: dict[str, str] = {}
    name = ""
    # Python 3.13 takes the common indentation off by itself
    _, _, block = inspect.cleandoc(described.__doc__ or "").partition("Attributes:")
    for line in block.splitlines():
        indent, text = len(line) - len(line.lstrip()), line.strip()
        head, colon, rest = text.partition(": ")
        if indent == 4 and colon and all(part.strip().isidentifier() for part in head.split(",")):
            name = head
            found |= {part.strip(): rest for part in head.split(",")}
        elif indent > 4 and name:
            found |= {part.strip(): f"{found[part.strip()]} {text}" for part in name.split(",")}
        elif text and indent < 4:
            break
    return found
