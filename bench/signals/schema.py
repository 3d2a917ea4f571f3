"""Documents of signals, stages and excitations: one model for each frozen description, read off its fields.

A family of descriptions (`bench.signals.description.Described`) is a union of models told apart by the entry ``type``. The models say
which entries there are and what kind of value each takes; the description that is then made checks the values against one another.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache
from typing import TYPE_CHECKING, Annotated, Any, Literal, get_origin

from pydantic import AfterValidator, BeforeValidator, Discriminator, Field, Tag, TypeAdapter, model_validator

from bench.documents import Document, Entry, Positive, Table, any_of, refuse, telling, told
from bench.documents.derived import SCALARS, entry_of, first_line
from bench.errors import shortened, unknown_name
from bench.signals.base import Signal
from bench.signals.description import Described
from bench.signals.excitation import Excitation

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
    def kind(hint: Any) -> Any:
        if hint in SCALARS or get_origin(hint) is Literal:
            return spread(SCALARS.get(hint, hint))
        return own if isinstance(hint, type) and issubclass(hint, Described) else None

    return entry_of(
        member,
        kind,
        kind=f"{family.kind} '{member.name}'",
        name=f"{member.__name__}{family.__name__}",
        type=(Literal[member.name], Field(description=first_line(member))),  # pyrefly: ignore[invalid-literal]
    )


def _maker(member: type[Described]) -> Callable[[Any], Described]:
    @told
    def made(entry: Any) -> Described:
        return member(**{name: value for name, value in entry.given.items() if name != "type"})

    return made


if TYPE_CHECKING:
    AnySignal = Signal
else:
    AnySignal = described_type(Signal)


class ExcitationDocument(Document):
    """What drives a rig: a signal for each actuator, for one duration at one sample rate."""

    entry_name = "an excitation"
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
