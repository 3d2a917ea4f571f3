"""Which suffix is which format, and the writing of each."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

from bench.errors import ParameterError, UnknownNameError
from bench.files import together, write_bytes, write_text
from bench.joint_export.mjcf import model_with
from bench.joint_export.onnx_graph import onnx_bytes
from bench.joint_export.python_module import module_text
from bench.joint_models.document import JointFile
from bench.nastran import INCH_POUND, SI, write_network

UNITS = MappingProxyType({"SI": SI, "inch-pound": INCH_POUND})


@dataclass(frozen=True)
class ExportOptions:
    """What a format has to be told.

    Attributes:
        model: MJCF that the joint is put into, for MJCF.
        components: Components of the virtual grid, 1 to 3 translations, 4 to 6 rotations, one a coordinate, for Nastran.
        bodies: Grids that the joint connects, for Nastran.
        units: "SI" or "inch-pound", for Nastran.
    """

    model: Path | None = None
    components: tuple[int, ...] = ()
    bodies: tuple[int, int] = (1, 2)
    units: str = "SI"


def _nastran(joint: JointFile, path: Path, options: ExportOptions) -> None:
    if options.units not in UNITS:
        raise UnknownNameError("units of a deck", options.units, UNITS)
    k = len(joint.element.joints)
    components = options.components or ((1, 4) if k == 2 else tuple(range(1, k + 1)))
    write_network(
        path, joint.element, components=components, bodies=options.bodies, units=UNITS[options.units]
    )


def _python(joint: JointFile, path: Path, _: ExportOptions) -> None:
    write_text(path, module_text(joint))


def _onnx(joint: JointFile, path: Path, _: ExportOptions) -> None:
    write_bytes(path, onnx_bytes(joint))


def _mjcf(joint: JointFile, path: Path, options: ExportOptions) -> None:
    if options.model is None:
        raise ParameterError("MJCF holds a joint only within a model; name yours with --mjcf model.xml")
    text, snippet = model_with(options.model, joint, path)
    with together():
        write_text(path, text)
        if snippet:
            write_text(path.with_suffix(".py"), snippet)


FORMATS: Mapping[str, tuple[str, Callable[[JointFile, Path, ExportOptions], None]]] = MappingProxyType(
    {
        ".bdf": ("Nastran bulk data (networks)", _nastran),
        ".xml": ("MJCF", _mjcf),
        ".py": ("Python, NumPy alone (polynomials, networks)", _python),
        ".onnx": ("ONNX, states to forces (polynomials, networks)", _onnx),
    }
)
"""Format by suffix."""


def export_joint(joint: JointFile, path: str | Path, options: ExportOptions | None = None) -> None:
    """Write a joint in the format that the suffix says.

    Raises:
        UnknownNameError: No such suffix.
        ParameterError: The format cannot hold this joint, or lacks an option.
        OutputError: The file cannot be written.
    """
    target = Path(path)
    if target.suffix not in FORMATS:
        raise UnknownNameError("suffix of an exported joint", target.suffix, FORMATS)
    FORMATS[target.suffix][1](joint, target, options or ExportOptions())


def written_by(path: Path) -> tuple[Path, ...]:
    """Files that an export to this place may write."""
    return (path, path.with_suffix(".py")) if path.suffix == ".xml" else (path,)
