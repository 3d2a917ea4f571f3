"""The document of settings: what `jointbench diagnose --settings` reads, and "settings" of a verdict."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, Strict

from bench.discrepancy.settings.diagnosis import DEFAULT, DiagnosisSettings, with_values
from bench.documents import AS_NUMBER, AS_WHOLE, Document, Entry, Listed, Number, checked, load_document
from bench.documents.derived import entry_of


def _kind(default: Any) -> Any:
    """The kind of values of a setting: of the type and the sign that its default has."""
    if isinstance(default, tuple):
        kind = Number if min(default) < 0.0 < max(default) else _kind(default[0])
        return Annotated[Listed[kind], Field(min_length=1)]
    if isinstance(default, int):
        return Annotated[int, Strict(), Field(ge=min(default, 1)), AS_WHOLE]
    if default < 0.0:
        return Annotated[float, Strict(), Field(lt=0.0, allow_inf_nan=False), AS_NUMBER]
    return Annotated[float, Strict(), Field(gt=0.0, allow_inf_nan=False), AS_NUMBER]


def _entry(settings: Any, kind: str, base: type[Entry] = Entry) -> type[Entry]:
    """The model of settings, each of which may be left out."""
    kinds: dict[str, Any] = {}
    for entry in fields(settings):
        value = getattr(settings, entry.name)
        kinds[entry.name] = (
            _entry(value, f"settings of '{entry.name}'") if is_dataclass(value) else _kind(value)
        )
    name = "SettingsDocument" if base is Document else f"{type(settings).__name__}Entry"
    return entry_of(type(settings), lambda hint: None, kind=kind, name=name, base=base, replaced=kinds)


SettingsDocument = _entry(DEFAULT, "settings", Document)
"""Settings of a diagnosis, as tables by room; what is left out keeps its default."""


def settings_of(data: Mapping[str, Any], where: str = "") -> DiagnosisSettings:
    """Settings from nested tables of values.

    Args:
        data: Values by the names of fields; what is left out keeps its default.
        where: The file, for messages.

    Raises:
        DocumentError: A value is of another type or sign than its default; `UnknownEntryError` where a name is not known, with the
            nearest one.
    """
    return with_values(
        DEFAULT, checked(SettingsDocument, data, where).model_dump(exclude_unset=True, exclude={"schema_"})
    )


def read_settings(path: str | Path) -> DiagnosisSettings:
    """Settings from a JSON or TOML file.

    Raises:
        FileFormatError: It cannot be read.
        DocumentError: As of `settings_of`.
    """
    return settings_of(load_document(path), str(path))
