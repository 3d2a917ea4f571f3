"""The files of an MJCF model: its text, and those that it includes, within limits and inside its folder.

A model from elsewhere may include itself, fan out without end, point at a pipe or out of its folder, or ask MuJoCo for a height
field of a million million points; all of that is refused before MuJoCo sees it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from xml.etree import ElementTree

from bench.errors import FileFormatError, ModelError
from bench.limits import READING_LIMITS, ReadingLimits, regular_file, size_text

_GENERATED = {
    "replicate": ("count",), "composite": ("count",), "flexcomp": ("count",), "hfield": ("nrow", "ncol"),
    "texture": ("width", "height"), "numeric": ("size",),
}  # fmt: skip
"""Elements of MJCF that make many things of one, and the attributes that say how many."""
_SIZES = ("nuserdata", "nkey", "nuser_body", "nuser_jnt", "nuser_geom", "nuser_site", "nuser_cam", "nuser_tendon",
          "nuser_actuator", "nuser_sensor", "nconmax", "njmax", "nstack")  # fmt: skip


@dataclass(frozen=True)
class MjcfFilesSettings:
    """Numbers of `bench.rig.mjcf_files`."""

    prefixes: Mapping[str, float] = field(
        default_factory=lambda: {
            "": 1.0,
            "k": 2.0**10,
            "m": 2.0**20,
            "g": 2.0**30,
            "t": 2.0**40,
            "p": 2.0**50,
            "e": 2.0**60,
        }
    )


SETTINGS = MjcfFilesSettings()


def mjcf_text(path: str | Path, *, limits: ReadingLimits = READING_LIMITS) -> str:
    """The text of an MJCF file.

    Args:
        path: The file.
        limits: What it may cost.

    Raises:
        ModelError: There is no such file, it is no regular file, too large, or no UTF-8 text.
    """
    try:
        return regular_file(path, limits.model_bytes).read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError, FileFormatError) as error:
        raise ModelError(f"cannot read the model {path}: {error}") from error


def included_files(text: str, folder: Path, *, limits: ReadingLimits = READING_LIMITS) -> dict[str, bytes]:
    """Contents of the files that an MJCF text includes, and of those that they include.

    Args:
        text: The text.
        folder: The folder of the model, in which the files have to lie.
        limits: What they may cost together.

    Raises:
        ModelError: A file cannot be read, lies outside the folder, includes itself, or is included too often; or an entry would
            make more of itself than the limits allow.
        xml.etree.ElementTree.ParseError: A text is no XML.
    """
    found: dict[str, bytes] = {}
    count, total = 0, len(text)

    def follow(content: str, chain: tuple[Path, ...]) -> None:
        nonlocal count, total
        root = _root(content)
        _refuse_multitudes(root, limits)
        _refuse_odd_files(root, folder)
        for node in root.iter("include"):
            name = node.get("file", "")
            count += 1
            if count > limits.included:
                raise ModelError(f"the MJCF includes more than {limits.included} files; merge them")
            path = _inside(folder, name)
            if path in chain:
                raise ModelError(f"the file {name!r} of the MJCF includes itself; remove that include")
            inner = mjcf_text(path, limits=limits)
            total += len(inner)
            if total > limits.model_bytes:
                raise ModelError(
                    f"the MJCF and its includes have more than {size_text(limits.model_bytes)}; simplify them"
                )
            found[name] = inner.encode("utf-8")
            follow(inner, (*chain, path))

    follow(text, ())
    return found


def _root(text: str) -> ElementTree.Element:
    try:
        return ElementTree.fromstring(text)
    except (
        ValueError,
        LookupError,
        RecursionError,
    ) as error:  # an encoding that nobody knows, nesting without end
        raise ModelError(f"the MJCF is no readable XML ({type(error).__name__}: {error})") from None


def _inside(folder: Path, name: str) -> Path:
    try:
        path, home = (folder / name).resolve(), folder.resolve()
    except (OSError, ValueError, RuntimeError) as error:
        raise ModelError(f"cannot read the file {name[:100]!r} that the MJCF includes: {error}") from None
    if not name or not path.is_relative_to(home):
        raise ModelError(
            f"the MJCF includes {name[:100]!r}, which lies outside its folder '{folder}'; copy it there, and include the copy"
        )
    return path


def _refuse_odd_files(root: ElementTree.Element, folder: Path) -> None:
    """Refuse meshes, textures and height fields that are pipes or devices: MuJoCo would wait for their end."""
    folders = {""}
    for compiler in root.iter("compiler"):
        folders |= {compiler.get(key, "") for key in ("meshdir", "texturedir", "assetdir")}
    for node in root.iter():
        if node.tag == "include":
            continue
        for key, name in node.attrib.items():
            if not key.startswith("file") or not name or key == "filename":
                continue
            for place in folders:
                try:
                    path = folder / place / name
                    odd = path.exists() and not path.is_file()
                except (OSError, ValueError) as error:
                    raise ModelError(f"the MJCF names a file {name[:100]!r}: {error}") from None
                if odd:
                    raise ModelError(
                        f"the MJCF names {name[:100]!r} as a file, which is no regular file; name another"
                    )


def _refuse_multitudes(root: ElementTree.Element, limits: ReadingLimits) -> None:
    """Refuse entries that would make more of themselves than any model holds."""
    waiting = [(root, 1.0)]
    while waiting:
        node, times = waiting.pop()
        made = 1.0
        for key in _GENERATED.get(str(node.tag), ()):
            made *= math.prod(max(_number(word), 1.0) for word in node.get(key, "").split()) or 1.0
        if node.tag == "size":
            made = max([_number(node.get(key, "")) for key in _SIZES], default=1.0)
            memory = node.get("memory", "").lower()
            if memory and _number(memory.rstrip("kmgtpe")) * SETTINGS.prefixes.get(memory[-1:], 1.0) > 1e9:
                raise ModelError(
                    f"the MJCF asks for memory of {node.get('memory', '')[:40]!r}; at most 1 GB is given"
                )
        times *= made if node.tag == "replicate" else 1.0
        if max(made, times) > limits.model_items:
            raise ModelError(
                f"an entry '{node.tag}' of the MJCF makes {max(made, times):.3g} of itself; at most {limits.model_items} are made"
            )
        waiting += [(child, times) for child in node]


def _number(word: str) -> float:
    try:
        value = float(word)
    except ValueError:
        return 0.0
    return value if math.isfinite(value) else math.inf
