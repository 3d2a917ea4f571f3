"""Identification: from records to models.

One module a method, each usable on arrays: `restoring_force` (a joint's forces from loads, inertia and mounts),
`polynomial` and `network` (models of a joint's states), `memory` (a joint that remembers), `parametric` (a law's parameters, hidden
states included), `surface` (restoring-force surfaces), `adaptive` (least squares on line), `damper` (design model and order study).
`bench.reduction` turns their results into elements.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from bench.identification.adaptive import AdaptiveLeastSquares
    from bench.identification.adaptive_history import AdaptiveHistory, Sample
    from bench.identification.damper import (
        DesignFit,
        OnlineDesignFit,
        fit_design_model,
        fit_design_model_online,
    )
    from bench.identification.damper_trust import TrustReport, check_design_model
    from bench.identification.linear_rig import LinearRig
    from bench.identification.memory import MemoryModel, MemoryReport, fit_memory
    from bench.identification.memory_settings import MemorySettings
    from bench.identification.network import NetworkModel, NetworkReport, fit_network
    from bench.identification.order_study import ForceRecord, OrderStudy
    from bench.identification.output_error import OutputErrorModel, fit_output_error
    from bench.identification.parametric import ParametricModel, fit_law
    from bench.identification.polynomial import PolynomialModel, PolynomialReport, fit_polynomial
    from bench.identification.regressors import (
        RegressorModel,
        bouc_wen_model,
        damper_model,
        given_model,
        polynomial_model,
        sdof_model,
    )
    from bench.identification.restoring_force import JointData, joint_data, joint_forces, unknown_mass_data
    from bench.identification.surface import RestoringSurface, coverage, fit_surface
    from bench.identification.validity_range import ValidityRange

_HOMES = {
    "AdaptiveHistory": "adaptive_history",
    "AdaptiveLeastSquares": "adaptive",
    "DesignFit": "damper",
    "ForceRecord": "order_study",
    "JointData": "restoring_force",
    "LinearRig": "linear_rig",
    "MemoryModel": "memory",
    "MemoryReport": "memory",
    "MemorySettings": "memory_settings",
    "NetworkModel": "network",
    "NetworkReport": "network",
    "OnlineDesignFit": "damper",
    "OrderStudy": "order_study",
    "OutputErrorModel": "output_error",
    "ParametricModel": "parametric",
    "PolynomialModel": "polynomial",
    "PolynomialReport": "polynomial",
    "RegressorModel": "regressors",
    "RestoringSurface": "surface",
    "Sample": "adaptive_history",
    "TrustReport": "damper_trust",
    "ValidityRange": "validity_range",
    "bouc_wen_model": "regressors",
    "check_design_model": "damper_trust",
    "coverage": "surface",
    "damper_model": "regressors",
    "fit_design_model": "damper",
    "fit_design_model_online": "damper",
    "fit_law": "parametric",
    "fit_memory": "memory",
    "fit_network": "network",
    "fit_output_error": "output_error",
    "fit_polynomial": "polynomial",
    "fit_surface": "surface",
    "given_model": "regressors",
    "joint_data": "restoring_force",
    "joint_forces": "restoring_force",
    "polynomial_model": "regressors",
    "sdof_model": "regressors",
    "unknown_mass_data": "restoring_force",
}

__all__ = [
    "AdaptiveHistory",
    "AdaptiveLeastSquares",
    "DesignFit",
    "ForceRecord",
    "JointData",
    "LinearRig",
    "MemoryModel",
    "MemoryReport",
    "MemorySettings",
    "NetworkModel",
    "NetworkReport",
    "OnlineDesignFit",
    "OrderStudy",
    "OutputErrorModel",
    "ParametricModel",
    "PolynomialModel",
    "PolynomialReport",
    "RegressorModel",
    "RestoringSurface",
    "Sample",
    "TrustReport",
    "ValidityRange",
    "bouc_wen_model",
    "check_design_model",
    "coverage",
    "damper_model",
    "fit_design_model",
    "fit_design_model_online",
    "fit_law",
    "fit_memory",
    "fit_network",
    "fit_output_error",
    "fit_polynomial",
    "fit_surface",
    "given_model",
    "joint_data",
    "joint_forces",
    "polynomial_model",
    "sdof_model",
    "unknown_mass_data",
]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
