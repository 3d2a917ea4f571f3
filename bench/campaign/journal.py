"""The journal of a campaign: what is finished, noted when it was written, each line with a check of its own.

The first line tells whose journal it is (hash of the plan, versions of the software), each further line is the entry of a part
as `bench.campaign.parts.part_entry` made it from the bytes that were written. A line's ``check`` hashes the plan's hash and the
line: one that was torn, changed, or copied from the journal of another plan is none.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from bench.campaign.parts import Layout
from bench.files import append_line, write_text

JOURNAL_FORMAT = 1
"""Version of the header line."""


class JournalNote(NamedTuple):
    """What a journal holds.

    Attributes:
        header: Its first line; None where it is missing or no header.
        entries: Entry by part, the latest where one comes twice.
        damaged: Numbers of the lines that were changed or are of another plan.
        torn: Numbers of the lines that are cut off, as a full disk or the end of a process leaves them.
    """

    header: Mapping[str, Any] | None
    entries: dict[int, dict[str, Any]]
    damaged: list[int]
    torn: list[int]


class Journal:
    """The journal of a campaign's folder.

    Args:
        path: Its file.
    """

    def __init__(self, path: Path) -> None:
        self.path = path

    @property
    def present(self) -> bool:
        """Whether there is one."""
        return self.path.is_file()

    def read(self, plan_sha256: str) -> JournalNote:
        """Read the lines that a campaign of this plan wrote, and tell the others.

        Args:
            plan_sha256: Hash of the plan.
        """
        header, entries, damaged, torn = None, {}, [], []
        try:
            text = self.path.read_text(encoding="utf-8", errors="replace")
        except OSError:
            return JournalNote(None, {}, [], [])
        for number, line in enumerate(text.split("\n"), start=1):
            found = _parsed(line)
            if number == 1 and found is not None and _is_header(found):
                header = found
            elif found is None:
                torn += [number] if line else []
            elif found.pop("check", "") == _check(found, plan_sha256):
                entries[found["part"]] = found
            else:
                damaged.append(number)
        return JournalNote(header, entries, damaged, torn)

    def write(
        self, plan_sha256: str, versions: Mapping[str, str], entries: Iterable[Mapping[str, Any]]
    ) -> None:
        """Write the journal anew, whole, with the entries given."""
        header = {"journal": JOURNAL_FORMAT, "plan_sha256": plan_sha256, "versions": dict(versions)}
        lines = [json.dumps(header, ensure_ascii=False), *(_line(entry, plan_sha256) for entry in entries)]
        write_text(self.path, "".join(f"{line}\n" for line in lines))

    def note(self, plan_sha256: str, entry: Mapping[str, Any]) -> None:
        """Add the entry of a part that was just finished, and wait until it is on the disk."""
        append_line(self.path, _line(entry, plan_sha256))


def journal_faults(
    journal: Journal,
    noted: JournalNote,
    layout: Layout,
    told: Mapping[int, Any],
    *,
    status: str,
    any_part: bool,
) -> list[str]:
    """What is wrong with a journal, given the entries of the manifest.

    Args:
        journal: The journal.
        noted: What was read from it.
        layout: The layout of the campaign.
        told: Entries of the manifest, which were copied from the journal.
        status: What the manifest says of the last run; only one that ended well leaves no lines cut off.
        any_part: Whether there are files of parts, which are made after the journal.
    """
    if journal.path.is_symlink():
        return ["journal.jsonl is a link"]
    if not journal.present:
        return ["journal.jsonl is missing"] if told or any_part else []
    if noted.header is None:
        return ["journal.jsonl is damaged in its first line, which tells the plan"]
    if noted.header["plan_sha256"] != layout.sha256:
        return ["journal.jsonl is of another campaign"]
    wrong = [
        f"journal.jsonl is damaged in line {number}"
        for number in sorted(noted.damaged + (noted.torn if status == "complete" else []))
    ]
    lacking = sorted(set(told) - set(noted.entries))
    if lacking:
        some = ", ".join(map(str, lacking[:5])) + (", …" if len(lacking) > 5 else "")
        wrong.append(f"journal.jsonl lacks parts that manifest.json holds as finished ({some})")
    return wrong


def _line(entry: Mapping[str, Any], plan_sha256: str) -> str:
    return json.dumps({**entry, "check": _check(entry, plan_sha256)})


def _check(entry: Mapping[str, Any], plan_sha256: str) -> str:
    text = json.dumps(entry, sort_keys=True)
    return hashlib.sha256(f"{plan_sha256} {text}".encode()).hexdigest()[:16]


def _is_header(found: Mapping[str, Any]) -> bool:
    return (
        found.get("journal") == JOURNAL_FORMAT
        and isinstance(found.get("versions"), dict)
        and isinstance(found.get("plan_sha256"), str)
    )


def _parsed(line: str) -> dict[str, Any] | None:
    try:
        found = json.loads(line)
    except (ValueError, RecursionError):
        return None
    return found if isinstance(found, dict) else None
