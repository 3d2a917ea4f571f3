"""A campaign on disk: a folder of parts that is at every moment the whole truth about what is done.

::

    manifest.json             plan, versions, hashes of every part, status
    samples/part-000123.parquet   record, sample, channels; a row group a record (or a few short ones)
    records/part-000123.parquet   record, status, rig, excitation, sensors and what they drew
    answers/part-000123.parquet   only where the plan withholds something: the rest of what was drawn
    answers/answers.json      and the whole plan
    journal.jsonl             one line a finished part, noted when it was written; the manifest is made from it

A part is finished when the journal notes it and its files are those that were noted (`bench.campaign.parts`). Files are
written elsewhere, flushed to the disk and moved into place, then noted. Whatever is killed when, a resumed campaign keeps
what is finished and makes the rest again. What is not of the campaign is moved to ``.set_aside``, never removed; only the
files of parts that were not noted are.
"""

from __future__ import annotations

import contextlib
import itertools
import json
import os
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from bench.campaign.journal import Journal, journal_faults
from bench.campaign.lock import CampaignError, locked
from bench.campaign.parts import (
    FOLDERS,
    Layout,
    any_part,
    counts,
    fault,
    is_entry,
    manifest_entries,
    mark_of,
    part_entry,
    part_name,
    public,
    strangers,
)
from bench.campaign.plan import Plan
from bench.campaign.versions import differing, versions
from bench.errors import FileFormatError
from bench.files import SYSTEM, OutputError, settle, write_bytes, write_text

FORMAT = 1
"""Version of the layout."""


class Opened(NamedTuple):
    """A campaign's folder at the start of a run.

    Attributes:
        entries: Entry by finished part.
        found: What was not as it was written, a line each; it is made again or was set aside.
    """

    entries: dict[int, dict[str, Any]]
    found: list[str]


class Store:
    """The folder of a campaign.

    Args:
        folder: The folder.
    """

    def __init__(self, folder: str | Path) -> None:
        self.folder = Path(folder).resolve()
        self.journal = Journal(self.folder / "journal.jsonl")

    @property
    def manifest_path(self) -> Path:
        """Path of the manifest."""
        return self.folder / "manifest.json"

    def path(self, kind: str, part: int) -> Path:
        """Path of a part in one of the folders of the data set."""
        return self.folder / kind / part_name(part)

    def manifest(self) -> dict[str, Any]:
        """Read the manifest.

        Raises:
            FileFormatError: There is none, or it is no manifest of a campaign.
        """
        from bench.campaign.manifest_schema import MANIFEST_LIMITS, ManifestDocument  # noqa: PLC0415  (pydantic, for those who read)
        from bench.documents import checked, load_document  # noqa: PLC0415

        try:
            document = load_document(self.manifest_path, limits=MANIFEST_LIMITS)
        except FileFormatError as error:
            raise FileFormatError(f"'{self.folder}' is no campaign: {error}") from error
        if document.get("format") != FORMAT:
            raise FileFormatError(
                f"'{self.manifest_path}' is no manifest of format {FORMAT}; a folder written by a campaign is expected"
            )
        checked(ManifestDocument, document, str(self.manifest_path))
        return document

    @contextlib.contextmanager
    def opened(self, plan: Plan, channels: list[dict[str, str]], *, resume: bool) -> Iterator[Opened]:
        """Make or reopen the folder for a run, alone; gives what is finished, and what was found amiss.

        Raises:
            CampaignError: It holds another campaign, one made with other versions, one at all without `resume`, other files,
                links in the place of its folders, or another process is at work in it.
            OutputError: It cannot be written to.
        """
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise OutputError(
                f"cannot write {self.folder}: {error.strerror}; choose another place"
            ) from error
        layout, found = Layout.of(plan), list[str]()
        with locked(self.folder):
            begun = self._begun(plan, resume=resume, found=found)
            if begun is None:  # before anything else, so that a folder begun is known as a campaign
                self.write_manifest(plan, channels, {}, status="running")
            for torn in (*self.folder.glob(".manifest.json.*"), *self.folder.glob(".journal.jsonl.*")):
                torn.unlink(missing_ok=True)
            self._make_folders(layout)
            if plan.withholds:
                self._write_answers(plan)
            found += self._set_aside(layout)
            entries = self._finished(layout, begun or {}, found)
            self.journal.write(layout.sha256, versions(), (entries[part] for part in sorted(entries)))
            self.write_manifest(plan, channels, entries, status="running")
            try:
                yield Opened(entries, found)
            finally:
                self._clear_partial()

    def _begun(self, plan: Plan, *, resume: bool, found: list[str]) -> dict[str, Any] | None:
        """The manifest of a campaign that was begun here, or what its journal tells instead; None where there is none."""
        header = self.journal.read(plan.sha256).header
        begun: dict[str, Any] | None = None
        if os.path.lexists(self.manifest_path):
            try:
                begun = self.manifest()
            except FileFormatError as error:
                if header is None:
                    raise
                found.append(f"manifest.json is damaged and was made again from the journal ({error})")
        elif header is not None:
            found.append("manifest.json was missing and was made again from the journal")
        if begun is None and header is None:
            if any(not entry.name.startswith(".") for entry in self.folder.iterdir()):
                raise CampaignError(
                    f"'{self.folder}' holds other files, and neither a manifest nor a journal of a campaign; "
                    "give a campaign a folder of its own"
                )
            return None
        begun = begun or {**(header or {}), "plan": {}}
        self._check_same(begun, plan, resume=resume)
        return begun

    def _check_same(self, begun: Mapping[str, Any], plan: Plan, *, resume: bool) -> None:
        if not resume:
            raise CampaignError(
                f"'{self.folder}' holds a campaign already; resume it, or choose another folder"
            )
        if begun.get("plan_sha256") != plan.sha256:
            raise CampaignError(
                f"'{self.folder}' holds a campaign of another plan ('{begun.get('name', '')}'); "
                "choose another folder, or resume with the plan it was begun with"
            )
        then = begun.get("versions")
        changed = differing(then if isinstance(then, Mapping) else {}, versions(), "now")
        if changed:
            raise CampaignError(
                f"the campaign in '{self.folder}' was begun with {changed}; its records could differ in their "
                "last bits: resume with the same versions, or choose another folder"
            )

    def _make_folders(self, layout: Layout) -> None:
        for name in (*layout.kinds, ".partial", ".set_aside"):
            path = self.folder / name
            if path.is_symlink():
                raise CampaignError(
                    f"'{path}' is a link, and what it points to may be of others; move the folder itself here"
                )
            try:
                path.mkdir(exist_ok=True)
            except OSError as error:
                raise OutputError(
                    f"cannot make the folder {path}: {error.strerror}; move away what is there"
                ) from error
        self._clear_partial()

    def _clear_partial(self) -> None:
        """Remove the files that a stopped run was writing."""
        for torn in (self.folder / ".partial").iterdir():
            with contextlib.suppress(OSError):
                torn.unlink()

    def discard(self, parts: Iterable[int]) -> None:
        """Remove the files of parts that a run put in place and, told to stop, did not come to note: they are made again."""
        for part, kind in itertools.product(parts, FOLDERS):
            with contextlib.suppress(OSError):
                self.path(kind, part).unlink()

    def _write_answers(self, plan: Plan) -> None:
        path = self.folder / "answers" / "answers.json"
        text = json.dumps({"plan": plan.to_dict(), "plan_sha256": plan.sha256}, indent=1, ensure_ascii=False)
        if path.is_symlink() or not path.is_file() or path.read_bytes() != text.encode():
            write_bytes(path, text.encode(), inside=self.folder / ".partial")

    def _set_aside(self, layout: Layout) -> list[str]:
        """Move what is not of the campaign out of the folders that readers take whole; tell what it was."""
        told = []
        for path, what in strangers(self.folder, layout):
            self._move_aside(path)
            told.append(f"{path.relative_to(self.folder)} {what} and was moved to .set_aside")
        return told

    def _aside(self, path: Path) -> Path:
        """A free name for a file of the campaign's folder among what was set aside."""
        name, number = "-".join(path.relative_to(self.folder).parts), 0
        place = self.folder / ".set_aside"
        while os.path.lexists(place / (f"{name}.{number}" if number else name)):
            number += 1
        return place / (f"{name}.{number}" if number else name)

    def _move_aside(self, path: Path) -> None:
        try:
            SYSTEM.replace(path, self._aside(path))
        except OSError as error:
            raise OutputError(f"cannot move {path} away: {error.strerror}; move it by hand") from error

    def _finished(
        self, layout: Layout, begun: Mapping[str, Any], found: list[str]
    ) -> dict[int, dict[str, Any]]:
        """Entries of the finished parts: those of the journal, or where it lacks them of the manifest, that files agree with."""
        noted = self.journal.read(layout.sha256)
        told = manifest_entries(begun, layout)
        status = str(begun.get("status", "running"))
        present = any_part(self.folder, layout)
        lost = journal_faults(self.journal, noted, layout, told, status=status, any_part=present)
        if lost and self.journal.path.is_symlink():
            self._move_aside(self.journal.path)
        elif lost and self.journal.present:  # a copy: until it is made again it holds what is finished
            write_bytes(self._aside(self.journal.path), self.journal.path.read_bytes())
        found += [f"{line}; it was made again" for line in lost]
        entries: dict[int, dict[str, Any]] = {}
        for part in range(layout.n_parts):
            entry = noted.entries.get(part) or told.get(part)
            if entry is None or not is_entry(layout, public(entry)):
                if status == "complete":  # what a stopped run leaves is nothing amiss
                    found += [
                        f"{name} is noted nowhere and is made again" for name in self._present(layout, part)
                    ]
                continue
            try:
                marks = {kind: mark_of(self.path(kind, part)) for kind in layout.kinds}
            except OSError:
                marks = {}
            wrong = fault(self.folder, layout, entry, whole=False)
            if wrong is None:
                entries[part] = {**entry, "marks": marks}
            else:
                found.append(f"{wrong[0]}/{part_name(part)} {wrong[1]}; the part is made again")
        return entries

    def _present(self, layout: Layout, part: int) -> list[str]:
        paths = [self.path(kind, part) for kind in layout.kinds]
        return [str(path.relative_to(self.folder)) for path in paths if os.path.lexists(path)]

    def write_part(
        self, plan: Plan, part: int, failed: list[int], contents: Mapping[str, bytes]
    ) -> dict[str, Any]:
        """Put the files of a part in place; return the entry to be noted, made from the bytes in memory.

        Raises:
            OutputError: They cannot be written.
        """
        entry = part_entry(Layout.of(plan), part, failed, contents)
        for kind, content in contents.items():
            # not beside their targets, since readers take whole folders
            write_bytes(self.path(kind, part), content, inside=self.folder / ".partial", settled=False)
        marks = {kind: mark_of(self.path(kind, part), content) for kind, content in contents.items()}
        return {**entry, "marks": marks}

    def check_present(self, entries: Mapping[int, Mapping[str, Any]]) -> None:
        """Raise `CampaignError` where a file that was noted is not there in its size: removed meanwhile, or on another disk."""
        for part, entry in entries.items():
            for kind, noted in entry["files"].items():
                path = self.path(kind, part)
                if not path.is_file() or path.stat().st_size != noted["bytes"]:
                    raise CampaignError(
                        f"{path} is not there as it was written; it was changed while the campaign ran, or lies on a disk that only "
                        "its worker sees: resume the campaign"
                    )

    def note(self, plan_sha256: str, entry: Mapping[str, Any]) -> None:
        """Note a finished part in the journal.

        Raises:
            OutputError: It cannot be written.
        """
        self.journal.note(plan_sha256, entry)

    def journaled(self) -> dict[int, dict[str, Any]]:
        """Entries of the journal by part, as far as they are as they were written.

        Raises:
            FileFormatError: The folder is no campaign.
        """
        layout = Layout.of_manifest(self.manifest())
        entries = self.journal.read(layout.sha256).entries
        return {part: entry for part, entry in entries.items() if is_entry(layout, public(entry))}

    def write_manifest(
        self,
        plan: Plan,
        channels: list[dict[str, str]],
        entries: Mapping[int, Mapping[str, Any]],
        *,
        status: str,
    ) -> None:
        """Write the manifest whole.

        Args:
            plan: The plan.
            channels: Name, unit, quantity and role of each channel.
            entries: Entry by finished part.
            status: "running", "stopped" or "complete".
        """
        for kind in Layout.of(plan).kinds if entries else ():  # names of parts are not waited for one by one
            settle(self.folder / kind)
        done = [public(entries[part]) for part in sorted(entries)]
        document = {
            "format": FORMAT,
            "name": plan.name,
            "status": status,
            "plan": plan.to_dict(public=True),
            "plan_sha256": plan.sha256,
            "seeds": "record k: numpy.random.SeedSequence(seed, spawn_key=(k,)).spawn(3) -> draw, excitation, sensors",
            "versions": versions(),
            "channels": channels,
            "counts": counts(done) | {"planned": plan.records},
            "parts": done,
        }
        write_text(self.manifest_path, json.dumps(document, indent=1, ensure_ascii=False))
