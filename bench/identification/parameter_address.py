"""Where a free parameter of a rig stands in its compiled model."""

from __future__ import annotations

from bench.errors import ParameterError, UnknownNameError
from bench.rig import Rig
from bench.rig.structure import STRUCTURE, Address, structure_address


def address(rig: Rig, name: str) -> Address:
    """Find a free parameter in the compiled model.

    Args:
        rig: The rig.
        name: "structure/<quantity>/<body, joint or tendon>" or "<element>/<parameter>".

    Raises:
        UnknownNameError: The rig has no such quantity, body, joint, element or parameter.
        ParameterError: The element is exact friction, which has no smooth response.
    """
    first, _, rest = name.partition("/")
    if first == "structure" and "/" in rest:
        kind, target = rest.split("/", 1)
        if kind == "frictionloss":
            raise UnknownNameError("structural quantity", kind, [k for k in STRUCTURE if k != kind])
        return structure_address(rig.model, kind, target)
    label, _, parameter = name.rpartition("/")
    element = rig.element(label)
    if element.exact:
        raise ParameterError(f"element '{label}' is exact friction; make it with exact=False to fit it")
    if parameter not in element.law.parameter_names:
        raise UnknownNameError(f"parameter of element '{label}'", parameter, element.law.parameter_names)
    item = next(item for item in rig.built.placed if item.element.name == label)
    place = len(element.law.header) + element.law.parameter_names.index(parameter)
    return Address("numeric_data", item.theta + place)
