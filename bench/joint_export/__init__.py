"""An identified joint for other tools: Nastran bulk data, MJCF, a Python module of NumPy alone, ONNX."""

from bench.joint_export.formats import FORMATS, ExportOptions, export_joint, written_by

__all__ = ["FORMATS", "ExportOptions", "export_joint", "written_by"]
