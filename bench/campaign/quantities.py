"""Quantities of a plan as they stand in its file: a number, a name, or a table that stands for a distribution."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from pydantic import (
    AfterValidator,
    BeforeValidator,
    Discriminator,
    Field,
    InstanceOf,
    Strict,
    Tag,
    TypeAdapter,
)
from pydantic.json_schema import SkipJsonSchema
from typing_extensions import TypeAliasType

from bench.campaign.distribution import (
    Choice,
    Distribution,
    Integers,
    LogUniform,
    Normal,
    Quantity,
    Shared,
    Uniform,
)
from bench.documents import Entry, Listed, Name, Number, NumberPair, Whole, any_of, checked_as, refuse, told
from bench.errors import shortened, unknown_name

Scalar = Annotated[
    Annotated[bool, Strict()] | Annotated[int, Strict()] | Number | Name,
    Field(union_mode="left_to_right"),
]
"""A number, a name, or true or false; whole numbers stay whole."""


class _Table(Entry):
    """A table that stands for a distribution."""

    entry_name = "a distribution"
    makes: ClassVar[Callable[..., Distribution | Shared]]

    def made(self) -> Distribution | Shared:
        """The distribution: the numbers of the first entry, and the options by name."""
        first, *options = type(self).model_fields
        given = {name: value for name, value in self.given.items() if name in options and value is not None}
        return type(self).makes(*getattr(self, first), **given)


class UniformTable(_Table):
    """Uniform between two numbers."""

    makes = Uniform
    uniform: NumberPair
    """Lowest and highest."""


class LogUniformTable(_Table):
    """Uniform in the logarithm, between two positive numbers."""

    makes = LogUniform
    log_uniform: NumberPair
    """Lowest and highest."""


class NormalTable(_Table):
    """Normal, truncated where an end is given."""

    makes = Normal
    normal: NumberPair
    """Mean and standard deviation."""
    low: Number | None = None
    """Lower end."""
    high: Number | None = None
    """Upper end."""


class IntegersTable(_Table):
    """A whole number, both ends included, all alike."""

    makes = Integers
    integers: Annotated[tuple[Whole, Whole], Strict(False)]
    """Lowest and highest."""


class ChoiceTable(_Table):
    """One of some numbers or names."""

    choice: Listed[Scalar] = Field(min_length=1)
    """The values."""
    weights: Listed[Number] = ()
    """A weight each; all alike without."""

    def made(self) -> Choice:
        """The choice."""
        return Choice(self.choice, self.weights)


class SharedTable(_Table):
    """The quantity of that name in the plan's table `shared`."""

    shared: Name
    """Its name."""
    times: Number = 1.0
    """Factor."""

    def made(self) -> Shared:
        """The quantity."""
        return Shared(self.shared, self.times)


TABLES: Mapping[str, type[_Table]] = {
    next(iter(set(table.model_fields) - {"low", "high", "weights", "times"})): table
    for table in (UniformTable, LogUniformTable, NormalTable, IntegersTable, ChoiceTable, SharedTable)
}
"""Table by the entry that tells what it stands for."""


def is_quantity_table(entry: object) -> bool:
    """Whether a table of a plan stands for a distribution (and not for a signal, a stage, …)."""
    return isinstance(entry, Mapping) and any(form in entry for form in TABLES)


def _one_form(entry: Any) -> Any:
    if isinstance(entry, Mapping):
        forms = [form for form in TABLES if form in entry]
        if len(forms) != 1:
            came = ", ".join(map(str, entry)) or "{}"
            refuse(unknown_name("distribution", came, TABLES), unknown=True)
        return dict(entry)
    return entry


def _form(entry: Any) -> str:
    return next(form for form in TABLES if form in entry) if isinstance(entry, Mapping) else "made"


def _numeric(quantity: Any) -> Any:
    if isinstance(quantity, Distribution) and quantity.textual:
        refuse("a choice of names came; a number or a distribution of numbers is expected")
    return quantity


def _stands_for(entry: Any) -> bool:
    return isinstance(entry, Mapping | Distribution | Shared)


def _stated(kinds: tuple[type, ...], expected: str) -> BeforeValidator:
    """Refuses what is neither a single value nor stands for a distribution, with an example of one."""

    def validator(entry: Any) -> Any:
        if not _stands_for(entry) and (
            not isinstance(entry, kinds) or (type(entry) is bool and bool not in kinds)
        ):
            refuse(f"{shortened(entry)} came; {expected} is expected")
        return entry

    return BeforeValidator(validator)


def _quantity(value: Any, distribution: Any, *more: Any) -> Any:
    return Annotated[
        any_of(Annotated[value, Tag("value")], Annotated[distribution, Tag("distribution")]),
        Discriminator(lambda entry: "distribution" if _stands_for(entry) else "value"),
        *more,
    ]


_made = told(lambda table: table.made())

if TYPE_CHECKING:
    AnyDistribution = Distribution | Shared
    NumberDistribution = AnyDistribution
    AnyQuantity = Quantity
    NumberQuantity = float | int | Distribution | Shared
else:
    AnyDistribution = TypeAliasType(
        "AnyDistribution",
        Annotated[
            any_of(
                Annotated[SkipJsonSchema[InstanceOf[Distribution | Shared]], Tag("made")],
                *(Annotated[table, AfterValidator(_made), Tag(form)] for form, table in TABLES.items()),
            ),
            Discriminator(_form),
            BeforeValidator(_one_form),
        ],
    )
    """A table that stands for a distribution, or for a shared quantity; validates to it."""
    NumberDistribution = Annotated[AnyDistribution, AfterValidator(_numeric)]
    AnyQuantity = TypeAliasType(
        "AnyQuantity",
        _quantity(
            Scalar,
            AnyDistribution,
            _stated((bool, int, float, str), "a number or a distribution as { uniform = [0.0, 1.0] }"),
        ),
    )
    """Validates to a `Quantity`."""
    NumberQuantity = TypeAliasType(
        "NumberQuantity",
        _quantity(
            Annotated[Annotated[int, Strict()] | Number, Field(union_mode="left_to_right")],
            NumberDistribution,
            _stated((int, float), "a number or a distribution of numbers"),
        ),
    )
    """A quantity that is a number."""

_QUANTITY: TypeAdapter[Quantity] = TypeAdapter(AnyQuantity)


def read_quantity(entry: Any, where: str) -> Quantity:
    """A number, a name or a distribution from a plan.

    Args:
        entry: The value or table.
        where: What the quantity is, for messages.

    Raises:
        DocumentError: No such distribution, an option that it lacks, or numbers that make none.
    """
    return checked_as(_QUANTITY, entry, where)


@cache
def spread(kind: Any) -> Any:
    """The type of a value in whose place a distribution may stand."""
    return _quantity(kind, NumberDistribution if kind in (Number, Whole) else AnyDistribution)
