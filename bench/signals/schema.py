"""Documents of signals, stages and excitations: one model for each frozen description, read off its fields.

A family of descriptions (`bench.signals.description.Described`) is a union of models told apart by the entry ``type``. The models say
which entries there are and what kind of value each takes; the description that is then made checks the values against one another.
"""

from __future__ import annotations

import types
from collections.abc import Callable, Mapping
from dataclasses import MISSING, fields
from functools import cache
from typing import (
    TYPE_CHECKING,
    Annotated,
    Any,
    ForwardRef,
    Literal,
    Union,
    get_args,
    get_origin,
    get_type_hints,
)

import numpy as np
from pydantic import (
    AfterValidator,
    BeforeValidator,
    Discriminator,
    Field,
    Strict,
    Tag,
    TypeAdapter,
    create_model,
    model_validator,
)
from pydantic_core import PydanticUndefined

from bench.documents import (
    Document,
    Entry,
    Flag,
    Listed,
    Number,
    Positive,
    Table,
    Text,
    Whole,
    any_of,
    refuse,
    telling,
    told,
)
from bench.errors import shortened, unknown_name
from bench.signals.base import Signal
from bench.signals.description import Described
from bench.signals.excitation import Excitation

_SCALARS: dict[Any, Any] = {float: Number, int: Whole, bool: Flag, str: Text}

Spread = Callable[[Any], Any]
"""Makes the type of a field from that of a single value, so that something else may stand in its place."""


def described_type(family: type[Described]) -> Any:
    """The annotated type of any member of a family, as it stands in a document; validates to the member itself."""
    return _family_type(family, tuple(family.registry()), _plain, build=True)


def varied_type(family: type[Described], spread: Spread) -> Any:
    """The same with other values allowed for single ones; validates to models, which only say that the document is valid."""
    return _family_type(family, tuple(family.registry()), spread, build=False)


def adapter(family: type[Described]) -> TypeAdapter[Any]:
    """Reads a member of a family."""
    return _adapter(family, tuple(family.registry()))


@cache
def _adapter(family: type[Described], names: tuple[str, ...]) -> TypeAdapter[Any]:
    return TypeAdapter(described_type(family))


def _plain(kind: Any) -> Any:
    return kind


@cache
def _family_type(family: type[Described], names: tuple[str, ...], spread: Spread, build: bool) -> Any:
    own = f"Any{family.__name__}"
    models = [_model(family, family.registry()[name], own, spread) for name in names]
    members = tuple(
        Annotated[model, *([AfterValidator(_maker(family.registry()[name]))] if build else []), Tag(name)]
        for name, model in zip(names, models, strict=True)
    )
    union = Annotated[any_of(*members), Discriminator(_type_of), BeforeValidator(_typed(family, names))]
    for model in models:
        model.model_rebuild(_types_namespace={own: union})
    return union


def _type_of(data: Any) -> Any:
    return data["type"] if isinstance(data, dict) else None


def _typed(family: type[Described], names: tuple[str, ...]) -> Callable[[Any], Any]:
    def validator(data: Any) -> Any:
        if not isinstance(data, Mapping) or "type" not in data:
            refuse(
                f"{shortened(data)} came; a {family.kind} is a table with an entry 'type' ({', '.join(sorted(names))})"
            )
        kind = data["type"]
        if not isinstance(kind, str):
            refuse(f"{shortened(kind)} came; the name of a {family.kind} is expected", "type")
        if kind not in names:
            refuse(unknown_name(f"{family.kind} type", kind, names), "type", unknown=True)
        return dict(data)

    return validator


def _model(family: type[Described], member: type[Described], own: str, spread: Spread) -> type[Entry]:
    hints = get_type_hints(member)
    texts = _attributes(member)
    entries: dict[str, Any] = {"type": (Literal[member.name], Field(description=_first_line(member)))}
    for field in fields(member):  # pyright: ignore[reportArgumentType]  (every member is a dataclass)
        default: Any = PydanticUndefined
        if field.default is not MISSING:
            default = field.default
        elif field.default_factory is not MISSING:
            default = field.default_factory()
        kind = _kind(hints[field.name], family, own, spread)
        entries[field.name] = (kind, Field(default, description=texts.get(field.name)))
    model = create_model(
        f"{member.__name__}{family.__name__}", __base__=Entry, __module__=__name__, **entries
    )
    model.kind = f"{family.kind} '{member.name}'"
    return model


def _kind(hint: Any, family: type[Described], own: str, spread: Spread) -> Any:
    """The type of an entry, from that of the description's field."""
    if hint in _SCALARS:
        return spread(_SCALARS[hint])
    origin, arguments = get_origin(hint), get_args(hint)
    if origin is Literal:
        return spread(hint)
    if isinstance(hint, type) and issubclass(hint, Described):
        return own
    if origin in {types.UnionType, Union}:
        kinds = tuple(a if a is type(None) else _kind(a, family, own, spread) for a in arguments)
        return any_of(*(_forward(kind) for kind in kinds))
    if origin is np.ndarray or hint is np.ndarray:
        return Listed[Number]
    if origin is tuple:
        inner = [_forward(_kind(a, family, own, spread)) for a in arguments if a is not Ellipsis]
        return Listed[inner[0]] if Ellipsis in arguments else _fixed(inner)
    raise TypeError(f"no document kind for the annotation {hint!r}")


def _forward(kind: Any) -> Any:
    return ForwardRef(kind) if isinstance(kind, str) else kind


def _fixed(inner: list[Any]) -> Any:
    return Annotated[tuple[tuple(inner)], Strict(False)]


def _maker(member: type[Described]) -> Callable[[Any], Described]:
    @told
    def made(entry: Any) -> Described:
        return member(**{name: value for name, value in entry.given.items() if name != "type"})

    return made


def _first_line(member: type[Any]) -> str:
    return (member.__doc__ or "").strip().splitlines()[0]


def _attributes(member: type[Any]) -> dict[str, str]:
    """The description of each attribute in a Google-style docstring."""
    found: dict[str, str] = {}
    name = ""
    _, _, block = (member.__doc__ or "").partition("Attributes:")
    for line in block.splitlines():
        indent, text = len(line) - len(line.lstrip()), line.strip()
        head, colon, rest = text.partition(": ")
        if indent == 8 and colon and head.isidentifier():
            name, found[head] = head, rest
        elif indent > 8 and name:
            found[name] += f" {text}"
        elif text and indent < 8:
            break
    return found


if TYPE_CHECKING:
    AnySignal = Signal
else:
    AnySignal = described_type(Signal)


class ExcitationDocument(Document):
    """What drives a rig: a signal for each actuator, for one duration at one sample rate."""

    kind = "an excitation"
    duration: Positive
    """Duration [s]."""
    sample_rate: Positive
    """Sample rate [Hz]."""
    signals: Annotated[Table[AnySignal], Field(min_length=1)]
    """Signal by name of the actuator."""

    @model_validator(mode="after")
    def _makes_an_excitation(self) -> ExcitationDocument:
        with telling():
            self.excitation()
        return self

    def excitation(self) -> Excitation:
        """The excitation."""
        return Excitation(self.signals, self.duration, self.sample_rate)
