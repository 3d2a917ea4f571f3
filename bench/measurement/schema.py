"""Documents of measurement chains."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pydantic import model_validator

from bench.documents import Entry, Listed, telling
from bench.measurement.base import Stage
from bench.measurement.chain import Chain
from bench.signals.schema import described_type

if TYPE_CHECKING:
    AnyStage = Stage
else:
    AnyStage = described_type(Stage)


class ChainDocument(Entry):
    """What lies between a physical quantity and the numbers in a file."""

    entry_name = "a chain"
    stages: Listed[AnyStage]
    """The stages, in the order in which they act."""

    @model_validator(mode="after")
    def _makes_a_chain(self) -> ChainDocument:
        with telling():
            self.chain()
        return self

    def chain(self) -> Chain:
        """The chain."""
        return Chain(*self.stages)
