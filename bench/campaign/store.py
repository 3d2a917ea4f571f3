"""A campaign on disk: a folder of parts that is at every moment the whole truth about what is done.

::

    manifest.json             plan, versions, hashes of every part, status
    samples/part-000123.parquet   record, sample, channels; a row group a record (or a few short ones)
    records/part-000123.parquet   record, status, rig, excitation, sensors and what they drew
    answers/part-000123.parquet   only where the plan withholds something: the rest of what was drawn
    answers/answers.json      and the whole plan
    journal.jsonl             one line a finished part, from which the manifest is made

A part is finished when its file in ``samples`` is there: it is written last, elsewhere, flushed to the disk and moved
into place. Whatever is killed when, a folder holds whole parts and nothing else, and a resumed campaign does the others.
The journal only saves hashing them again.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import secrets
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from bench.campaign.plan import Plan
from bench.errors import BenchError, FileFormatError
from bench.files import OutputError, write_text
from bench.provenance import software_versions

FORMAT = 1
"""Version of the layout."""
FOLDERS = ("samples", "records", "answers")
BYTES_DEPEND_ON = ("jointbench", "mujoco", "numpy", "scipy", "numba", "pyarrow")
"""Distributions that must be the same when a campaign is resumed."""


class CampaignError(BenchError, RuntimeError):
    """A campaign cannot be run, resumed or read."""


def part_name(index: int) -> str:
    """File name of a part."""
    return f"part-{index:06d}.parquet"


def versions() -> dict[str, str]:
    """Versions of what the bytes of a campaign depend on, and of Python."""
    from importlib.metadata import version  # noqa: PLC0415

    return {**dict(software_versions()), "pyarrow": version("pyarrow")}


class Store:
    """The folder of a campaign.

    Args:
        folder: The folder.
    """

    def __init__(self, folder: str | Path) -> None:
        self.folder = Path(folder).resolve()

    @property
    def manifest_path(self) -> Path:
        """Path of the manifest."""
        return self.folder / "manifest.json"

    def path(self, kind: str, part: int) -> Path:
        """Path of a part in one of `FOLDERS`."""
        return self.folder / kind / part_name(part)

    def manifest(self) -> dict[str, Any]:
        """Read the manifest.

        Raises:
            FileFormatError: There is none, or it is no manifest of a campaign.
        """
        from bench.campaign.schema import MANIFEST_LIMITS, ManifestDocument  # noqa: PLC0415  (pydantic, for those who read)
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
    def opened(
        self, plan: Plan, channels: list[dict[str, str]], *, resume: bool
    ) -> Iterator[dict[int, dict[str, Any]]]:
        """Make or reopen the folder for a run, alone; gives the entries of the parts that are finished.

        Raises:
            CampaignError: It holds another campaign, one made with other versions, one at all without `resume`, other files,
                or another process is at work in it.
            OutputError: It cannot be written to.
        """
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise OutputError(
                f"cannot write {self.folder}: {error.strerror}; choose another place"
            ) from error
        with self._locked():
            if self.manifest_path.exists():
                self._check_same(plan, resume=resume)
            elif any(not entry.name.startswith(".") for entry in self.folder.iterdir()):
                raise CampaignError(f"'{self.folder}' holds other files; give a campaign a folder of its own")
            else:  # before anything else, so that a folder begun is known as a campaign
                self.write_manifest(plan, channels, {}, status="running")
            for torn in (*self.folder.glob(".manifest.json.*"), *self.folder.glob(".journal.jsonl.*")):
                torn.unlink(missing_ok=True)
            for name in FOLDERS if plan.withholds else FOLDERS[:2]:
                (self.folder / name).mkdir(exist_ok=True)
            partial = self.folder / ".partial"
            partial.mkdir(exist_ok=True)
            for torn in partial.iterdir():
                torn.unlink(missing_ok=True)
            if plan.withholds:
                answers = {"plan": plan.to_dict(), "plan_sha256": plan.sha256}
                write_text(
                    self.folder / "answers" / "answers.json",
                    json.dumps(answers, indent=1, ensure_ascii=False),
                )
            entries = self._finished(plan)
            self.write_manifest(plan, channels, entries, status="running")
            yield entries

    @contextlib.contextmanager
    def _locked(self) -> Iterator[None]:
        """Hold the folder; the system lets go of it when the process ends, however it ends."""
        with (self.folder / ".lock").open("w") as lock:
            try:
                import fcntl  # noqa: PLC0415  (not on Windows, where nobody keeps two runs apart)

                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except ImportError:
                pass
            except OSError as error:
                raise CampaignError(
                    f"another process is at work in '{self.folder}'; wait for it or stop it"
                ) from error
            yield

    def _check_same(self, plan: Plan, *, resume: bool) -> None:
        manifest = self.manifest()
        if not resume:
            raise CampaignError(
                f"'{self.folder}' holds a campaign already; resume it, or choose another folder"
            )
        if manifest["plan_sha256"] != plan.sha256:
            raise CampaignError(
                f"'{self.folder}' holds a campaign of another plan ('{manifest['plan'].get('name')}'); "
                "choose another folder, or resume with the plan it was begun with"
            )
        now = versions()
        changed = [
            f"{name} {manifest['versions'].get(name)} (now {now[name]})"
            for name in BYTES_DEPEND_ON
            if name in now and manifest["versions"].get(name) != now[name]
        ]
        if changed:
            raise CampaignError(
                f"the campaign in '{self.folder}' was begun with {', '.join(changed)}; its records could differ in their "
                "last bits: resume with the same versions, or choose another folder"
            )

    def _finished(self, plan: Plan) -> dict[int, dict[str, Any]]:
        """Entries of the finished parts: from the journal, and read off the files where it lacks them."""
        entries = self.journaled()
        journal = self.folder / "journal.jsonl"
        present = {
            path.name: path.stat().st_size for path in (self.folder / "samples").glob("part-*.parquet")
        }
        for part in range(plan.n_parts):
            size = present.get(part_name(part))
            others = [self.path(kind, part) for kind in (FOLDERS[1:] if plan.withholds else FOLDERS[1:2])]
            if size is None or not all(path.exists() for path in others):
                entries.pop(part, None)
            elif part not in entries or entries[part]["files"]["samples"]["bytes"] != size:
                entries[part] = self.entry_from_files(plan, part)
        text = "".join(json.dumps(entries[part]) + "\n" for part in sorted(entries))
        write_text(journal, text)
        return entries

    def journaled(self) -> dict[int, dict[str, Any]]:
        """Entries of the journal by part; lines that are torn, or that no campaign wrote, are passed over."""
        from bench.campaign.schema import PartEntry  # noqa: PLC0415
        from bench.documents import checked, parse_json  # noqa: PLC0415

        journal = self.folder / "journal.jsonl"
        entries: dict[int, dict[str, Any]] = {}
        if not journal.exists():
            return entries
        with journal.open(encoding="utf-8", errors="replace") as lines:
            for line in lines:
                with contextlib.suppress(FileFormatError):  # the last line of a killed run may be torn
                    entry = parse_json(line, str(journal))
                    entries[checked(PartEntry, entry).part] = entry
        return entries

    def entry_from_files(self, plan: Plan, part: int) -> dict[str, Any]:
        """The entry of a finished part, from its files alone."""
        import pyarrow.parquet as pq  # noqa: PLC0415

        table = pq.ParquetFile(self.path("records", part)).read(columns=["record", "status"]).to_pydict()
        failed = [r for r, status in zip(table["record"], table["status"], strict=True) if status != "ok"]
        contents = {
            kind: self.path(kind, part).read_bytes() for kind in FOLDERS if self.path(kind, part).exists()
        }
        return entry_of(plan, part, failed, contents)

    def write_part(
        self, plan: Plan, part: int, failed: list[int], contents: Mapping[str, bytes]
    ) -> dict[str, Any]:
        """Put the files of a part in place, the samples last; return its entry."""
        for kind in reversed(FOLDERS):
            if kind in contents:
                self._put(self.path(kind, part), contents[kind])
        return entry_of(plan, part, failed, contents)

    def _put(self, path: Path, content: bytes) -> None:
        # not bench.files.replacing, whose temporary files lie beside their targets: readers take whole folders
        temporary = self.folder / ".partial" / f"{path.parent.name}-{path.name}.{secrets.token_hex(4)}"
        try:
            with temporary.open("xb") as file:
                file.write(content)
                file.flush()
                os.fsync(file.fileno())
            os.replace(temporary, path)
        except OSError as error:
            temporary.unlink(missing_ok=True)
            raise OutputError(
                f"cannot write {path}: {error.strerror}; free some space and resume the campaign"
            ) from error
        if os.name == "posix":
            folder = os.open(path.parent, os.O_RDONLY)
            try:
                os.fsync(folder)
            finally:
                os.close(folder)

    def journal(self, entry: Mapping[str, Any]) -> None:
        """Note a finished part."""
        with (self.folder / "journal.jsonl").open("a", encoding="utf-8") as file:
            file.write(json.dumps(entry) + "\n")

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
        done = [entries[part] for part in sorted(entries)]
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


def entry_of(plan: Plan, part: int, failed: list[int], contents: Mapping[str, bytes]) -> dict[str, Any]:
    """What journal and manifest say of a part."""
    records = len(plan.part(part))
    return {
        "part": part,
        "first": part * plan.records_per_part,
        "records": records,
        "ok": records - len(failed),
        "failed": failed,
        "rows": (records - len(failed)) * plan.n_samples,
        "files": {
            kind: {"bytes": len(contents[kind]), "sha256": hashlib.sha256(contents[kind]).hexdigest()}
            for kind in FOLDERS
            if kind in contents
        },
    }


def counts(entries: list[Mapping[str, Any]] | list[dict[str, Any]]) -> dict[str, int]:
    """Sums over the entries of parts."""
    return {
        "records": sum(entry["records"] for entry in entries),
        "ok": sum(entry["ok"] for entry in entries),
        "failed": sum(len(entry["failed"]) for entry in entries),
        "rows": sum(entry["rows"] for entry in entries),
        "bytes": sum(file["bytes"] for entry in entries for file in entry["files"].values()),
    }


def verify(folder: str | Path) -> list[str]:
    """Compare every file of a campaign with its hash in the manifest.

    Returns:
        What does not agree, a line a file; empty where all is as it was written.

    Raises:
        FileFormatError: The folder is no campaign.
    """
    store = Store(folder)
    wrong = []
    for entry in store.manifest()["parts"]:
        for kind, file in entry["files"].items():
            path = store.path(kind, entry["part"])
            if kind == "answers" and not path.parent.exists():
                continue  # sealed elsewhere
            if not path.exists():
                wrong.append(f"{path.relative_to(store.folder)} is missing")
                continue
            with path.open("rb") as stream:
                if hashlib.file_digest(stream, "sha256").hexdigest() != file["sha256"]:
                    wrong.append(f"{path.relative_to(store.folder)} differs from what was written")
    return wrong
