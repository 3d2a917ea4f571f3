"""What documents say of an element: the law, and what it acts on."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from bench.documents import Entry, Flag, Label, Listed, Name, Number
from bench.laws.base import MAX_COORDINATES, ForceLaw
from bench.laws.registry import LAWS, MODELS, find_law


class PlacedLaw(Entry):
    """A force law placed in a structure, without its parameters."""

    entry_name = "an element"
    law: Annotated[Name, Field(json_schema_extra={"enum": [*LAWS, *MODELS]})]
    """Name of the force law, as `jointbench laws` lists them."""
    joints: Listed[Name] = Field(min_length=1, max_length=MAX_COORDINATES)
    """Joints or fixed tendons that the law acts on, in the order of the law."""
    header: Listed[Number] = ()
    """Size of a law that has one."""
    inputs: Listed[Name] = Field((), max_length=MAX_COORDINATES)
    """Actuators whose commands the law reads."""
    name: Label = ""
    """Name of the element; the joints' and the law's where empty."""
    exact: Flag = False
    """Coulomb friction by MuJoCo's own constraint, which sticks."""

    @property
    def found(self) -> ForceLaw:
        """The law.

        Raises:
            UnknownNameError: No law has that name.
            ParameterError: The law has no such header.
        """
        return find_law(self.law, self.header)

    @property
    def label(self) -> str:
        """Name of the element."""
        return self.name or f"{'+'.join(self.joints)}.{self.law}"
