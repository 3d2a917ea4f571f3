"""Documents of the blind protocol: what a case tells its runner, and the answers."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import ConfigDict, Field, Strict, model_validator

from bench.documents import (
    AS_NUMBER,
    Document,
    DocumentLimits,
    Entry,
    Flag,
    Label,
    Listed,
    Name,
    NumberPair,
    Positive,
    Text,
    refuse,
)

AnyNumber = Annotated[float, Strict(), AS_NUMBER]
"""A number that may be infinite: log odds may."""
Numbers = Annotated[Listed[AnyNumber], Field(min_length=1)]
ANSWER_LIMITS = DocumentLimits(finite=False)


class ProtocolDocument(Document):
    """What a case tells its runner."""

    entry_name = "a protocol"
    exclude: Listed[Name] = ()
    """Effects left out of the catalogue."""


class _Open(Entry):
    """A table that others may add to: answers come from every maker of cases, and only what is scored is looked at."""

    model_config = ConfigDict(extra="allow")
    entry_open = True


class AnswerEffect(_Open):
    """A withheld effect."""

    entry_name = "an effect of an answer"
    name: Name
    """Name in the catalogue, or of what no catalogue holds."""
    where: Label | None = ""
    """Its place."""


class AnswerRegion(_Open):
    """Where in the state space an effect acts."""

    entry_name = "a region of an answer"
    dof: Literal["", "axial", "torsional"]
    """Place."""
    coordinate: Literal["displacement", "velocity"]
    """Coordinate."""
    reach: Positive
    """Largest magnitude of the coordinate."""
    intervals: Listed[NumberPair]
    """Where it acts."""


class Detectability(_Open):
    """How well the records of a case can tell its effect."""

    entry_name = "the detectability of an answer"
    log_odds_none: AnyNumber | None = None
    """Expected log odds against nothing."""
    log_odds_rival: AnyNumber | None = None
    """Expected log odds against the nearest rival."""
    rival: Text = ""
    """The nearest rival."""


class AnswerDocument(Document, _Open):
    """The answer of a sealed case."""

    entry_name = "an answer"
    kind: Literal["none", "single", "double", "foreign", "main", "background", "unstated", "clean"] = Field(
        alias="class"
    )
    """Class of the case."""
    effects: Listed[AnswerEffect]
    """Withheld effects."""
    struck: Listed[Name] = ()
    """Effects left out of the catalogue."""
    rig: Text = ""
    """The rig."""
    regions: Listed[AnswerRegion] | None = None
    """Where the effects act."""
    detectability: Detectability | None = None
    """How well the records can tell them."""
    gap_nrmse_identification: AnyNumber | Numbers | None = None
    """Gap of the records for finding."""
    gap_nrmse_validation: AnyNumber | Numbers | None = None
    """Gap of the judging record."""
    noise: AnyNumber | dict[str, AnyNumber | None] | None = None
    """Noise over the standard deviation of a channel; or noise by channel, which no score asks for."""
    sensors: Text | Listed[Name] | None = None
    """Kind of sensors, or the response channels."""
    signals: Listed[Name] = ()
    """Kinds of loads."""
    commanded: Flag | None = None
    """Whether the load is a command."""
    background: Listed[Name] | None = None
    """Small things that no model has besides; null where the case is not of that world."""
    background_share: AnyNumber | None = None
    """Their part of the main discrepancy."""
    main_gap: AnyNumber | None = None
    """Main discrepancy: what re-estimated nominal parameters leave of the effect's."""
    noise_stated: Literal["true", "small", "no"] = "true"
    """Whether the noise is stated, too small, or not at all."""

    @model_validator(mode="after")
    def _effects_are_of_the_class(self) -> AnswerDocument:
        expected = {"none": 0, "single": 1, "double": 2, "background": 0, "clean": 0}.get(
            self.kind, len(self.effects)
        )
        if len(self.effects) != expected:
            refuse(
                f"{len(self.effects)} effects came; {expected} are expected of the class {self.kind}",
                "effects",
            )
        return self
