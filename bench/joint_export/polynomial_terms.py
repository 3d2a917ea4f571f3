"""The terms of a polynomial law, read off its header."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bench.errors import ParameterError
from bench.rig.element import Element


class Terms(NamedTuple):
    """A polynomial ``r_o = sum_t c_ot prod_i P_e(t,i)((s_i - centre_i) / scale_i)``."""

    exponents: NDArray[np.int64]
    """``(n_terms, 2 k)``."""
    coefficients: NDArray[np.float64]
    """``(k, n_terms)``."""
    centre: NDArray[np.float64]
    """``(2 k,)``."""
    scale: NDArray[np.float64]
    """``(2 k,)``."""
    chebyshev: bool


def terms_of(element: Element) -> Terms:
    """The terms of a polynomial element.

    Raises:
        ParameterError: It holds another law.
    """
    if element.law.name != "polynomial":
        raise ParameterError(
            f"polynomials and networks, functions of the present state, can be written so; this joint is the law '{element.law.name}': "
            "export it as MJCF (.xml), or call bench.laws.evaluate"
        )
    header = element.law.header
    if header[0] >= 2.0:
        raise ParameterError(
            f"element '{element.name}' is a polynomial that is held at the edge of its data; only one that is its terms everywhere can be "
            "written so: identify it with bounded=False, or export it as MJCF (.xml)"
        )
    n = int(header[1])
    names = [name for name in element.law.parameter_names if name.startswith("a1[")]
    exponents = np.array([[int(x) for x in name[3:-1].split(",")] for name in names], dtype=np.int64)
    values = element.theta[len(header) :].reshape(n, len(names))
    centre, inverse = np.array(header[5 : 5 + 2 * n]), np.array(header[5 + 2 * n : 5 + 4 * n])
    return Terms(exponents, values, centre, 1.0 / inverse, bool(header[0]))
