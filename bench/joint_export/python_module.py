"""An identified joint as a Python module that needs NumPy alone."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bench.joint_export.polynomial_terms import Terms, terms_of
from bench.joint_models.document import JointFile
from bench.nastran import network_weights

_HEAD = '''"""Restoring force of the joint '{name}', identified by jointbench as a {kind}; SI units.

`force(q, v)` takes displacements and velocities, (k,) or (n, k) of the {k} coordinate(s) {joints}, and gives the
restoring forces in the same shape, positive where they oppose a positive displacement: apply minus this to the body.
"""

import numpy as np

{numbers}

def force(q, v):
    """Restoring forces at displacements `q` and velocities `v`."""
    s = np.concatenate([np.atleast_2d(q), np.atleast_2d(v)], axis=1)
    {outside}
{body}
    return r.reshape(np.shape(q))
'''


def module_text(joint: JointFile) -> str:
    """The module.

    Raises:
        ParameterError: The joint has a memory.
    """
    own = joint.element
    validity = own.validity
    numbers: dict[str, NDArray] = {}
    outside = "# no range of validity is known"
    if hasattr(validity, "minimum"):
        numbers |= {"MINIMUM": validity.minimum, "MAXIMUM": validity.maximum}  # type: ignore[union-attr]
        outside = "s = s if UNBOUNDED else np.clip(s, MINIMUM, MAXIMUM)  # a model knows nothing beyond what it was identified on"
    if own.law.name == "network":
        weights = network_weights(own)
        numbers |= dict(zip(("W1", "B1", "W2", "B2"), weights, strict=True))
        body = "    r = np.tanh(s @ W1.T + B1) @ W2.T + B2"
    else:
        body = _polynomial(terms_of(own), numbers)
    lines = [f"{name} = np.array({_listed(value)})" for name, value in numbers.items()]
    if "MINIMUM" in numbers:
        lines.append("UNBOUNDED = False  # True: beyond the range too")
    return _HEAD.format(
        name=own.name,
        kind=joint.kind,
        k=len(own.joints),
        joints=", ".join(own.joints),
        numbers="\n".join(lines) + "\n",
        outside=outside,
        body=body,
    )


def _listed(array: NDArray) -> str:
    return repr(np.asarray(array).tolist())


def _polynomial(terms: Terms, numbers: dict[str, NDArray]) -> str:
    numbers |= {
        "CENTRE": terms.centre,
        "SCALE": terms.scale,
        "EXPONENTS": terms.exponents,
        "COEFFICIENTS": terms.coefficients,
    }
    c = "2.0 * u * rows[-1] - rows[-2]" if terms.chebyshev else "u * rows[-1]"
    return "\n".join(
        [
            "    u = (s - CENTRE) / SCALE",
            "    rows = [np.ones_like(u), u]",
            "    while len(rows) <= EXPONENTS.max():",
            f"        rows.append({c})",
            "    rows = np.array(rows)  # (order, n, states)",
            "    terms = np.ones((len(s), len(EXPONENTS)))",
            "    for i in range(s.shape[1]):",
            "        terms *= rows[EXPONENTS[:, i], :, i].T",
            "    r = terms @ COEFFICIENTS.T",
        ]
    )
