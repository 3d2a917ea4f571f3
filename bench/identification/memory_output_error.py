"""A joint with memory fitted through the whole rig that it is in, where only the rig's motion was measured.

What equation error cannot give: differentiated displacements carry their noise into the accelerations, and with it into every weight.
`fit_memory` gives the start; every parameter then goes on by the output-error fit of the whole rig, batched over threads. All bounds
of the law hold on the way, so that the joint is passive at every step.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

from bench.identification.fit_data import read_only
from bench.identification.memory import MemoryModel
from bench.identification.output_error import OutputErrorModel, fit_output_error
from bench.recording import Recording
from bench.rig import Rig


class RefinedInRig(NamedTuple):
    """A joint with memory after an output-error fit."""

    model: MemoryModel
    fit: OutputErrorModel


def refine_in_rig(
    model: MemoryModel,
    rig: Rig,
    element: str,
    records: Sequence[Recording],
    *,
    structure: Sequence[str] = (),
    **settings: Any,
) -> RefinedInRig:
    """Refine a joint with memory, and numbers of the structure around it, by output error.

    Ranges of slip elements and the places of zero force stay: a range only moves the grid that stiffness and slip are resolved on.

    Args:
        model: The joint as `fit_memory` gave it.
        rig: The rig with it in place.
        element: Name of its element.
        records: Records of the rig's sensors, as of `fit_output_error`.
        structure: Structural parameters fitted along, as "structure/mass/carriage".
        **settings: Passed on to `fit_output_error`.

    Raises:
        UnknownNameError: As `fit_output_error`.
        IdentificationError: As `fit_output_error`.
    """
    n_fixed = len(model.layout.header())
    free = [
        f"{element}/{name}" for name in model.law.parameter_names if not name.startswith(("phi", "r", "tau"))
    ]
    fit = fit_output_error(rig, records, free=[*structure, *free], **settings)
    parameters = read_only(fit.rig.element(element).theta[n_fixed:])
    return RefinedInRig(replace(model, parameters=parameters), fit)
