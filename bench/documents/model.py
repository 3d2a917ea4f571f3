"""The models that documents are checked by, and the one sentence in which a document that does not fit is refused.

A kind of document is a pydantic model here; what the model takes is valid, and nothing else decides. Names are checked before
values, so that a misspelt entry is told with its nearest known name and not as one that is missing. Domain objects (rigs, plans,
cases) are built from a model's fields and say in their own words what they cannot be; `told` carries these words into the model's
report, so that the place within the document stands before them.
"""

from __future__ import annotations

import contextlib
import functools
from collections.abc import Callable, Iterator, Mapping
from importlib import import_module
from pathlib import Path
from typing import Any, ClassVar, NoReturn, ParamSpec, Self, TypeVar

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError, model_validator
from pydantic_core import PydanticCustomError

from bench.documents.loading import LIMITS, DocumentLimits, load_document, spelt
from bench.errors import (
    BenchError,
    DocumentError,
    UnknownEntryError,
    UnknownNameError,
    shortened,
    unknown_name,
)

P = ParamSpec("P")
R = TypeVar("R")
M = TypeVar("M", bound=BaseModel)


class Entry(BaseModel):
    """A table within a document.

    Attributes:
        entry_name: What it is, as it reads in a message: "an element", "a rig configuration".
        entry_misnomers: Entries that people write, and those that are meant, where the spelling does not tell.
        entry_hints: What to write for entries that are needed.
        entry_open: Whether others may add entries of their own.
    """

    model_config = ConfigDict(
        strict=True, extra="forbid", frozen=True, allow_inf_nan=False, use_attribute_docstrings=True
    )
    entry_name: ClassVar[str] = "a table"
    entry_misnomers: ClassVar[Mapping[str, str]] = {}
    entry_hints: ClassVar[Mapping[str, str]] = {}
    entry_open: ClassVar[bool] = False

    @model_validator(mode="before")
    @classmethod
    def _entries_are_known(cls, data: Any) -> Any:
        if isinstance(data, cls):
            return data
        if not isinstance(data, Mapping):
            refuse(f"{shortened(data)} came; {cls.entry_name} is a table of entries")
        known = {field.alias or name: field for name, field in cls.model_fields.items()}
        for key in data:
            if key not in known and not cls.entry_open:
                meant = cls.entry_misnomers.get(str(key), "")
                text = unknown_name(f"entry of {cls.entry_name}", str(key), known)
                if meant and "Did you mean" not in text:
                    text += f" Did you mean '{meant}'?"
                refuse(text, unknown=True)
        needed = [key for key, field in known.items() if field.is_required() and key != "type"]
        missing = [key for key in needed if key not in data]
        if missing:
            hint = f" ({cls.entry_hints[missing[0]]})" if missing[0] in cls.entry_hints else ""
            refuse(f"{cls.entry_name} needs {', '.join(needed)}; {', '.join(missing)} missing{hint}")
        return dict(data)

    @property
    def given(self) -> dict[str, Any]:
        """Fields that the document states, by name, in the order of the model."""
        return {
            name: getattr(self, name) for name in type(self).model_fields if name in self.model_fields_set
        }


class Document(Entry):
    """A whole document; it may name its schema, as editors want it."""

    schema_: str = Field("", alias="$schema")
    """Address or path of the JSON Schema, for editors; not looked at."""

    @classmethod
    def read(cls, path: str | Path, *, limits: DocumentLimits = LIMITS) -> Self:
        """Read a file.

        Raises:
            FileFormatError: It cannot be read.
            DocumentError: It is no such document; the message names the place in it.
        """
        return checked(cls, load_document(path, limits=limits), str(path))


def checked(model: type[M], data: Any, where: str = "", **context: Any) -> M:
    """The model of a document's data.

    Args:
        model: Its model.
        data: As it was loaded, or made by a program.
        where: The file, for messages.
        **context: What the model's validators are told.

    Raises:
        DocumentError: The data are no such document; `UnknownEntryError` where a name is not known.
    """
    try:
        return model.model_validate(data, context=context)
    except ValidationError as error:
        raise refusal(error, data, where) from None


def checked_as(adapter: TypeAdapter[R], data: Any, where: str = "") -> R:
    """The value that data stand for by a type adapter; as `checked`."""
    try:
        return adapter.validate_python(data)
    except ValidationError as error:
        raise refusal(error, data, where) from None


def refuse(text: str, *at: str | int, unknown: bool = False) -> NoReturn:
    """Refuse from within a validator.

    Args:
        text: What came, and what is expected.
        *at: Place below that of the validator.
        unknown: Whether a name is not known.
    """
    raise PydanticCustomError("bench", "{text}", {"text": text, "at": at, "unknown": unknown})


@contextlib.contextmanager
def telling(*at: str | int) -> Iterator[None]:
    """Refuse, from within a validator, what a domain object refuses."""
    try:
        yield
    except UnknownNameError as error:
        refuse(str(error), *at, unknown=True)
    except BenchError as error:
        refuse(str(error), *at)


def told(function: Callable[P, R]) -> Callable[P, R]:
    """A validator whose `BenchError`s stand in the model's report."""

    @functools.wraps(function)
    def validator(*args: P.args, **keywords: P.kwargs) -> R:
        with telling():
            return function(*args, **keywords)

    return validator


@contextlib.contextmanager
def naming(where: str) -> Iterator[None]:
    """Put the file before what a domain object says of a document that its model took."""
    try:
        yield
    except DocumentError:
        raise
    except UnknownNameError as error:
        raise UnknownEntryError(f"{where}: {error}") from error
    except BenchError as error:
        raise DocumentError(f"{where}: {error}") from error


def refusal(error: ValidationError, data: Any, where: str) -> DocumentError:
    """The one sentence about the first thing that does not fit: file, place, what came, what is expected."""
    details = [(_place(detail, data), detail) for detail in error.errors(include_url=False)]
    place = details[0][0]
    # of a list that is no number, and of which one member does not fit, the member is told
    place = next((at for at, _ in details if len(at) > len(place) and at[: len(place)] == place), place)
    same = [detail for at, detail in details if at == place]
    others = len({at for at, _ in details if at != place[: len(at)]})
    head = ": ".join(part for part in (where, spelt(place)) if part)
    text, unknown = _sentence(same, place)
    if others:
        text += f" ({others} more {'entry does' if others == 1 else 'entries do'} not fit)"
    message = f"{head}: {text}" if head else text
    return UnknownEntryError(message) if unknown else DocumentError(message)


def _place(detail: Any, data: Any) -> tuple[str | int, ...]:
    """Path of an error in the data; pydantic's own path also names the members of unions, which no document holds."""
    path: list[str | int] = []
    node = data
    for step in detail["loc"]:
        if (isinstance(node, Mapping) and step in node) or (
            isinstance(step, int) and isinstance(node, list | tuple) and step < len(node)
        ):
            node = node[step]
        else:
            continue
        path.append(step)
    path += detail.get("ctx", {}).get("at", ())
    return tuple(path)


def _sentence(details: list[Any], place: tuple[str | int, ...]) -> tuple[str, bool]:
    first = details[0]
    context = first.get("ctx", {})
    if first["type"] == "bench":
        return context["text"], bool(context.get("unknown"))
    if first["type"] == "value_error":
        return str(context["error"]), False
    if first["type"] == "union_tag_invalid":
        known = [name.strip("' ") for name in context["expected_tags"].split(",")]
        return unknown_name("type", str(context["tag"]), known), True
    came = shortened(first["input"])
    if first["type"] == "literal_error" and len(details) == 1 and isinstance(first["input"], str):
        known = [name.strip("' ") for name in context["expected"].replace(" or ", ",").split(",")]
        return unknown_name(str(place[-1]) if place else "word", first["input"], known), True
    expected = list(dict.fromkeys(_expected(detail) for detail in details))
    return f"{came} came; {' or '.join(expected)} is expected", False


_EXPECTED: Mapping[str, str] = {
    "float_type": "a number", "float_parsing": "a number", "finite_number": "a finite number",
    "int_type": "a whole number", "int_from_float": "a whole number", "int_parsing": "a whole number",
    "bool_type": "true or false", "bool_parsing": "true or false", "string_type": "text",
    "dict_type": "a table of entries", "mapping_type": "a table of entries", "model_type": "a table of entries",
    "tuple_type": "a list", "list_type": "a list", "iterable_type": "a list", "none_required": "null",
    "union_tag_not_found": "a table with an entry 'type'", "recursion_loop": "less nesting",
    "string_pattern_mismatch": "one line of printable text",
}  # fmt: skip


def _expected(detail: Any) -> str:
    kind, context = detail["type"], detail.get("ctx", {})
    if kind in _EXPECTED:
        return _EXPECTED[kind]
    if kind == "literal_error":
        return f"one of {context['expected']}"
    bounds = {"greater_than": ("gt", "above"), "greater_than_equal": ("ge", "of at least"),
              "less_than": ("lt", "below"), "less_than_equal": ("le", "of at most")}  # fmt: skip
    if kind in bounds:
        name, word = bounds[kind]
        return f"a number {word} {context[name]:g}"
    if kind == "string_too_short":
        return f"text of at least {context['min_length']} character"
    if kind == "string_too_long":
        return f"text of at most {context['max_length']} characters"
    if kind in {"too_short", "too_long"}:
        what = "a table" if isinstance(detail["input"], Mapping) else "a list"
        least, most = context.get("min_length"), context.get("max_length")
        return f"{what} of at least {least}" if kind == "too_short" else f"{what} of at most {most}"
    if kind == "missing":  # of a list of fixed length: tables are looked through before
        return "one value more"
    return detail["msg"][:1].lower() + detail["msg"][1:]


def schema_of(package: str) -> Any:
    """The module that says what the documents of a package look like: its `schema`.

    Models are made from the classes that they describe. A class that reads itself from a document asks for its model here, since
    importing it would close a circle.
    """
    return import_module(f"{package}.schema")
