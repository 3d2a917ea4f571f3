"""Documents: the JSON and TOML files that people and programs write, each checked by one model.

`load_document` reads a file within limits; a `Document` is a pydantic model that alone decides whether what was read is valid;
whatever is not is a `DocumentError` of one line with the file, the place in it, what came, what is expected, and the nearest name
that is known. The models give the JSON Schemas that editors complete by (`jointbench schema`).
"""

from bench.documents.kinds import (
    AS_NUMBER,
    AS_WHOLE,
    Count,
    Flag,
    Label,
    Limit,
    Listed,
    Name,
    NotNegative,
    Number,
    NumberPair,
    Positive,
    Probability,
    Table,
    Text,
    Whole,
    any_of,
)
from bench.documents.loading import LIMITS, DocumentLimits, load_document, parse_json, read_text
from bench.documents.model import (
    Document,
    Entry,
    checked,
    checked_as,
    naming,
    refuse,
    schema_of,
    telling,
    told,
)

__all__ = [
    "AS_NUMBER",
    "AS_WHOLE",
    "LIMITS",
    "Count",
    "Document",
    "DocumentLimits",
    "Entry",
    "Flag",
    "Label",
    "Limit",
    "Listed",
    "Name",
    "NotNegative",
    "Number",
    "NumberPair",
    "Positive",
    "Probability",
    "Table",
    "Text",
    "Whole",
    "any_of",
    "checked",
    "checked_as",
    "load_document",
    "naming",
    "parse_json",
    "read_text",
    "refuse",
    "schema_of",
    "telling",
    "told",
]
