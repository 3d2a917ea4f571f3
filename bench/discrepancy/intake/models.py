"""The model of a case from whatever holds it: a path, MJCF text, an MjSpec, an MjModel."""

from __future__ import annotations

import contextlib
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import mujoco

from bench import native
from bench.discrepancy.application.applying import Applied, specification, told
from bench.discrepancy.application.writing import model_text
from bench.errors import ModelError
from bench.files import write_text

_REFERRING = ("<include", " file=", "meshdir", "texturedir", "assetdir")
"""What makes an MJCF depend on where it lies."""


@dataclass(frozen=True, eq=False)
class ModelFile:
    """A model in a file.

    Attributes:
        path: The file.
        name: Name that it has in a case.
    """

    path: Path
    name: str

    @cached_property
    def compiled(self) -> mujoco.MjModel:
        """It, compiled.

        Raises:
            ModelError: MuJoCo does not read or compile it.
        """
        try:
            return specification(self.path).compile()
        except ValueError as error:
            raise ModelError(f"'{self.path}' is no MJCF that MuJoCo compiles: {told(error)}") from None

    def text_for(self, folder: Path) -> str:
        """Its text, to stand in a folder: as it is, or with what it refers to found from there."""
        text = self.path.read_text(encoding="utf-8")
        if not any(word in text for word in _REFERRING):
            return text
        spec = specification(self.path)
        spec.compile()
        changed = model_text(Applied(spec, (), {}, str(self.path.parent)), folder.resolve(), self.path.name)
        return changed.partition("-->\n")[2]


@contextlib.contextmanager
def model_file(source: Any) -> Iterator[ModelFile]:
    """A model as a file, for as long as it is needed.

    Args:
        source: Path, MJCF text, `mujoco.MjSpec` or `mujoco.MjModel`.

    Raises:
        ModelError: It cannot be read, or is an MjModel that MuJoCo cannot write any more.
    """
    if isinstance(source, Path) or (isinstance(source, str) and "<" not in source):
        path = Path(source)
        if not path.is_file():
            raise ModelError(f"there is no model '{path}'; give the path of an MJCF file")
        yield ModelFile(path, path.name if path.suffix == ".xml" else f"{path.stem}.xml")
        return
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "model.xml"
        write_text(path, _text_of(source, path))
        yield ModelFile(path, path.name)


@native.quiet()
def _text_of(source: Any, path: Path) -> str:
    if isinstance(source, str):
        return source
    if isinstance(source, mujoco.MjSpec):
        spec = source.copy()
        try:
            spec.compile()
        except ValueError as error:
            raise ModelError(f"the MjSpec does not compile: {told(error)}") from None
        return spec.to_xml()
    if isinstance(source, mujoco.MjModel):
        try:
            mujoco.mj_saveLastXML(str(path), source)
        except (mujoco.FatalError, ValueError) as error:
            raise ModelError(
                f"MuJoCo cannot write this MjModel as MJCF ({told(error)}); give its MJCF or MjSpec instead"
            ) from None
        again = mujoco.MjModel.from_xml_path(str(path))
        if (again.nq, again.nv, again.nu, again.nbody) != (source.nq, source.nv, source.nu, source.nbody):
            raise ModelError(
                "another model than this MjModel was loaded since, so that MuJoCo cannot write it; give its MJCF or MjSpec instead"
            )
        return path.read_text(encoding="utf-8")
    raise ModelError(
        f"a {type(source).__name__} came for a model; a path, MJCF text, MjSpec or MjModel is expected"
    )
