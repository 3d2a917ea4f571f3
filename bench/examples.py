"""The examples that come with the bench, copied to where a user can change them."""

from __future__ import annotations

import shutil
from pathlib import Path

from bench.errors import UnknownNameError
from bench.targets import check_target_folder, check_targets


def _folder() -> Path:
    here = Path(__file__).resolve().parent
    return (
        here / "_examples" if (here / "_examples").is_dir() else here.parent / "examples"
    )  # wheel, or source tree


def _kept(path: Path) -> bool:
    return not any(part.startswith((".", "__")) for part in path.relative_to(_folder()).parts)


def example_names() -> dict[str, Path]:
    """The examples by name: a folder by its own, a single file by its stem."""
    return {path.stem: path for path in sorted(_folder().iterdir()) if _kept(path)}


def copy_example(name: str, target: str | Path | None = None, *, force: bool = False) -> list[Path]:
    """Copy an example.

    Args:
        name: One of `example_names`.
        target: Folder of a folder, file of a file; by its own name into the present folder where None.
        force: Overwrite files that exist.

    Returns:
        The files that were written.

    Raises:
        UnknownNameError: There is no such example.
        OutputError: Something stands in the way.

    Example:
        >>> copy_example("mismatch", "my-stage")  # doctest: +SKIP
    """
    known = example_names()
    if name not in known:
        raise UnknownNameError("example", name, known)
    source = known[name]
    place = Path(target) if target is not None else Path(source.name)
    if source.is_file():
        check_targets(place, force=force)
        place.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(source, place)
        return [place]
    check_target_folder(place, force=force)
    files = [path for path in sorted(source.rglob("*")) if path.is_file() and _kept(path)]
    for path in files:
        copy = place / path.relative_to(source)
        copy.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(path, copy)
    return [place / path.relative_to(source) for path in files]
