"""Holding a campaign against what was noted of it when it was written."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from bench.campaign.journal import journal_faults
from bench.campaign.parts import (
    Layout,
    any_part,
    counts,
    file_fault,
    is_entry,
    manifest_entries,
    part_name,
    public,
    strangers,
)
from bench.campaign.store import Store


def verify(folder: str | Path) -> list[str]:
    """Compare every file of a campaign with what was noted when it was written.

    Found are files that are missing, differ, are links, hold the records of another part or lie there without being noted,
    files that are not of the campaign, a journal that is lost, damaged or of another campaign, and a manifest that says
    something else than the journal. Without the folder ``answers`` (sealed elsewhere) the rest is compared.

    Args:
        folder: The campaign; an unfinished one is compared as far as it is.

    Returns:
        What does not agree, a line each; empty where all is as it was written.

    Raises:
        FileFormatError: The folder is no campaign.
    """
    store = Store(folder)
    manifest = store.manifest()
    layout = Layout.of_manifest(manifest)
    noted = store.journal.read(layout.sha256)
    told = manifest_entries(manifest, layout)
    entries = told | {p: public(e) for p, e in noted.entries.items() if is_entry(layout, public(e))}
    status, present = str(manifest.get("status")), any_part(store.folder, layout)
    wrong = [
        f"{name} is a link" for name in ("manifest.json", *layout.kinds) if (store.folder / name).is_symlink()
    ]
    wrong += _manifest_faults(manifest, layout, told, entries)
    wrong += journal_faults(store.journal, noted, layout, told, status=status, any_part=present)
    if layout.withholds and (store.folder / "answers").exists():
        wrong += _answers_faults(store.folder / "answers" / "answers.json", layout)
    wrong += [
        f"{path.relative_to(store.folder)} {what}"
        for path, what in strangers(store.folder, layout)
        if what != "is a link"  # told with the part
    ]
    for part in range(layout.n_parts):
        wrong += _part_faults(store, layout, part, entries.get(part))
    return wrong


def _manifest_faults(
    manifest: Mapping[str, Any], layout: Layout, told: Mapping[int, Any], entries: Mapping[int, Any]
) -> list[str]:
    wrong = []
    parts = manifest.get("parts")
    if not isinstance(parts, list) or len(told) != len(parts):
        wrong.append("manifest.json holds parts that its plan does not make")
    if not layout.withholds:
        text = json.dumps(manifest["plan"], sort_keys=True, ensure_ascii=False)
        if hashlib.sha256(text.encode()).hexdigest() != layout.sha256:
            wrong.append("manifest.json holds another plan than the one it names by its hash")
    wrong += [
        f"manifest.json tells part {p} otherwise than journal.jsonl" for p in told if told[p] != entries[p]
    ]
    if manifest.get("status") != "running":
        wrong += [
            f"manifest.json lacks part {p}, which is noted as finished" for p in entries if p not in told
        ]
        expected = counts(list(told.values())) | {"planned": layout.records}
        if manifest.get("counts") != expected:
            wrong.append("manifest.json counts otherwise than its parts")
    if manifest.get("status") == "complete":
        wrong += [f"part {p} is noted nowhere" for p in range(layout.n_parts) if p not in entries]
    return wrong


def _answers_faults(path: Path, layout: Layout) -> list[str]:
    try:
        plan = json.loads(path.read_text(encoding="utf-8"))["plan"]
        text = json.dumps(plan, sort_keys=True, ensure_ascii=False)
    except FileNotFoundError:
        return ["answers/answers.json is missing"]
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        text = ""
    right = hashlib.sha256(text.encode()).hexdigest() == layout.sha256
    return [] if right else ["answers/answers.json differs from what was written"]


def _part_faults(store: Store, layout: Layout, part: int, entry: Mapping[str, Any] | None) -> list[str]:
    wrong = []
    for kind in layout.kinds:
        path = store.path(kind, part)
        if kind == "answers" and not path.parent.exists():
            continue  # sealed elsewhere
        if entry is not None:
            what = file_fault(path, layout, entry, kind, whole=True)
        else:
            what = "is not noted as finished" if path.is_symlink() or path.exists() else ""
        if what:
            wrong.append(f"{kind}/{part_name(part)} {what}")
    return wrong
