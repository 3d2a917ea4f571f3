"""Document of the manifest that a campaign leaves."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, Strict, model_validator

from bench.campaign.schema import PlanDocument
from bench.documents import (
    Document,
    DocumentLimits,
    Entry,
    Listed,
    Name,
    Text,
    refuse,
)

MANIFEST_LIMITS = DocumentLimits()
"""A manifest of as many parts as `PlanLimits` allows stays within these."""

Integer = Annotated[int, Strict(), Field(ge=0)]
"""A whole number as programs write it: 3.0 is none."""


class DataChannelEntry(Entry):
    """A channel of a data set."""

    entry_name = "a channel of a manifest"
    name: Name
    """Name."""
    unit: Text
    """Unit."""
    quantity: Text
    """Quantity."""
    role: Text
    """Role."""


class PartFile(Entry):
    """A file of a part."""

    entry_name = "a file of a part"
    bytes: Integer
    """Size."""
    sha256: Text
    """Hash."""


class PartEntry(Entry):
    """A finished part."""

    entry_name = "a part of a manifest"
    part: Integer
    """Number."""
    first: Integer
    """First record."""
    records: Integer
    """Number of records."""
    ok: Integer
    """Records that have samples."""
    failed: Listed[Integer]
    """Records that failed."""
    rows: Integer
    """Rows of samples."""
    files: dict[Literal["samples", "records", "answers"], PartFile]
    """Its files."""

    @model_validator(mode="after")
    def _files_are_there(self) -> PartEntry:
        missing = {"samples", "records"} - set(self.files)
        if missing:
            refuse(f"a part has samples and records; {' and '.join(sorted(missing))} missing", "files")
        if self.ok + len(self.failed) != self.records:
            refuse(
                f"{self.ok} records and {len(self.failed)} failed ones came; {self.records} in all are expected"
            )
        return self


class ManifestDocument(Document):
    """What a campaign says of itself."""

    entry_name = "a manifest"
    format: Literal[1]
    """Version of the layout."""
    name: Text
    """Name."""
    status: Literal["running", "stopped", "complete"]
    """Whether all parts are finished."""
    plan: PlanDocument
    """The plan, without what is withheld."""
    plan_sha256: Text
    """Hash of the whole plan."""
    seeds: Text
    """How a record's random streams are made."""
    versions: dict[str, Text]
    """Versions of what the bytes depend on."""
    channels: Listed[DataChannelEntry]
    """Channels of the data set."""
    counts: dict[str, Integer]
    """Sums over the finished parts."""
    parts: Listed[PartEntry]
    """Finished parts."""

    @model_validator(mode="after")
    def _parts_are_of_the_plan(self) -> ManifestDocument:
        for index, part in enumerate(self.parts):
            if part.first + part.records > self.plan.records:
                refuse(
                    f"records {part.first} to {part.first + part.records - 1} came; the plan has {self.plan.records}",
                    "parts", index,
                )  # fmt: skip
        return self
