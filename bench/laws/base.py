"""What a force law is: a frozen description, and kernels compiled once to plain C functions.

A law gives the restoring force of a joint, positive when it opposes positive displacement, so that a single mass obeys
``m x'' + f(t, q, v, z) = F``. Its hidden states obey ``dz/dt = rate(t, q, v, z)``.

Kernels are written once, as a function of seven arguments that are only ever indexed::

    @kernel
    def force(t, q, v, z, theta, f): f[0] += theta[0] * q[0]

and compiled on first use to the C signature ``void(double, double*, double*, double*, double*, double*)``. The same
machine code is called by the MuJoCo callback, by the whole-record loops below, by the fits and by the tests: no law
is written twice. A kernel adds into ``f`` and writes ``zdot``; it never raises (a bad argument gives NaN or inf, which
`bench.rig.simulate` reports with time and element) and never allocates.

Compiled code is cached between processes by numba beside the source file; nothing is compiled on import.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bench.errors import ParameterError, UnknownNameError

Smoothness = Literal["smooth", "continuous", "discontinuous"]

MAX_COORDINATES = 16
"""Most coordinates (joints, tendons and inputs together) an element may act on."""


class Kernel:
    """A law's function compiled to a C function when its address is first asked for.

    Attributes:
        function: The Python source function ``(t, q, v, z, theta, out) -> None``; callable, slow, for inspection.
    """

    def __init__(self, function: Callable[..., None]) -> None:
        self.function = function
        self.__doc__ = function.__doc__
        self.__name__ = function.__name__
        self.__module__ = function.__module__

    def __call__(self, t: float, q: Any, v: Any, z: Any, theta: Any, out: Any) -> None:
        """Run the Python source of the kernel (for inspection and debugging; every product path is compiled)."""
        self.function(t, q, v, z, theta, out)

    @cached_property
    def compiled(self) -> Any:
        """The numba `cfunc`; kept alive here for as long as the law exists."""
        import numba  # noqa: PLC0415  (half a second that `import bench` need not pay)
        from numba import types  # noqa: PLC0415

        pointer = types.CPointer(types.float64)
        signature = types.void(types.float64, pointer, pointer, pointer, pointer, pointer)
        try:
            return numba.cfunc(signature, cache=True, error_model="numpy")(self.function)
        except RuntimeError:  # defined at a prompt: there is no file beside which machine code could be kept
            return numba.cfunc(signature, error_model="numpy")(self.function)

    @property
    def address(self) -> int:
        """Address of the compiled C function in this process."""
        return self.compiled.address

    def __reduce__(self) -> str | tuple[Any, ...]:
        return (_kernel_by_name, (self.__module__, self.function.__qualname__))


def _kernel_by_name(module: str, qualname: str) -> Kernel:
    import importlib  # noqa: PLC0415

    return getattr(importlib.import_module(module), qualname)


def kernel(function: Callable[..., None]) -> Kernel:
    """Mark a module-level function as the kernel of a law."""
    return Kernel(function)


@dataclass(frozen=True)
class Parameter:
    """One parameter of a law.

    Attributes:
        name: Field-standard name ("stiffness", "clearance", "A", …).
        unit: Unit for a translational joint, as a pint expression ("N/m"); `rotational` for a rotational one.
        default: A typical value, used in documentation, contract tests and as a start of fits.
        bounds: Smallest and largest admissible value.
        description: One line for tables.
        rotational: Unit on a rotational joint; None where it equals `unit`.
    """

    name: str
    unit: str
    default: float
    bounds: tuple[float, float] = (-math.inf, math.inf)
    description: str = ""
    rotational: str | None = None

    def __post_init__(self) -> None:
        low, high = self.bounds
        if not low <= self.default <= high:
            raise ParameterError(
                f"default {self.default} of parameter '{self.name}' lies outside its bounds {self.bounds}"
            )


@dataclass(frozen=True)
class ForceLaw:
    """A force law ``f = force(t, q, v, z; theta)`` with hidden states ``dz/dt = rate(t, q, v, z; theta)``.

    Attributes:
        name: Name in the registry (`bench.laws.LAWS`).
        parameters: The parameters in the order of `theta`.
        states: Names of the hidden states, with unit in brackets; empty for a law without memory.
        force: Kernel that adds the restoring force into ``f``, one entry a coordinate.
        rate: Kernel that writes ``zdot``; None for a law without states.
        equation: The law in one line, for documentation and reports.
        reference: Author, year and equation.
        n_coordinates: Number of coordinates the law acts on.
        n_inputs: Number of these (the last ones) that are inputs: read in ``q``, no force returned.
        smoothness: "smooth" (C1 force, RK4 keeps its order), "continuous" (kinks) or "discontinuous" (jumps).
        initial_state: Kernel-free start of the hidden states; zeros where None.
        header: Leading entries of ``theta`` that fix sizes (orders, widths) and are not parameters.
    """

    name: str
    parameters: tuple[Parameter, ...]
    force: Kernel
    rate: Kernel | None = None
    states: tuple[str, ...] = ()
    equation: str = ""
    reference: str = ""
    n_coordinates: int = 1
    n_inputs: int = 0
    smoothness: Smoothness = "smooth"
    initial_state: tuple[float, ...] | None = None
    header: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        if bool(self.states) != (self.rate is not None):
            raise ParameterError(
                f"law '{self.name}': states {self.states} need a rate kernel, and a rate kernel needs states"
            )
        if not 1 <= self.n_coordinates <= MAX_COORDINATES:
            raise ParameterError(
                f"law '{self.name}' acts on {self.n_coordinates} coordinates; 1 to {MAX_COORDINATES} are possible"
            )
        if not 0 <= self.n_inputs < self.n_coordinates:
            raise ParameterError(
                f"law '{self.name}': {self.n_inputs} inputs among {self.n_coordinates} coordinates"
            )

    @property
    def parameter_names(self) -> tuple[str, ...]:
        """Names of the parameters in the order of theta."""
        return tuple(parameter.name for parameter in self.parameters)

    def theta(self, values: ArrayLike | None = None, /, **named: float) -> NDArray[np.float64]:
        """The law's `theta` from a vector, or from names, the others at their defaults.

        Args:
            values: All parameters in order (n_parameters,), without the header; or None.
            **named: Single parameters by name.

        Returns:
            ``(n_header + n_parameters,)``, checked against the bounds.

        Raises:
            UnknownNameError: A name is no parameter of this law.
            ParameterError: Wrong length, not finite, or outside the bounds.
        """
        for name in named:
            if name not in self.parameter_names:
                raise UnknownNameError(f"parameter of law '{self.name}'", name, self.parameter_names)
        if values is None:
            vector = np.array([named.get(p.name, p.default) for p in self.parameters], dtype=float)
        else:
            vector = np.array(values, dtype=float)
            if vector.shape == (len(self.header) + len(self.parameters),) and self.header:
                vector = vector[len(self.header) :]
            if vector.shape != (len(self.parameters),):
                raise ParameterError(
                    f"law '{self.name}' takes {len(self.parameters)} parameters "
                    f"({', '.join(self.parameter_names[:12])}{', …' if len(self.parameters) > 12 else ''}); "
                    f"an array of shape {vector.shape} came"
                )
            for name, value in named.items():
                vector[self.parameter_names.index(name)] = value
        for parameter, value in zip(self.parameters, vector, strict=True):
            low, high = parameter.bounds
            if not (np.isfinite(value) and low <= value <= high):
                raise ParameterError(
                    f"parameter '{parameter.name}' of law '{self.name}' is {value:g} {parameter.unit}; "
                    f"a finite value in [{low:g}, {high:g}] is expected"
                )
        return np.concatenate([np.asarray(self.header, dtype=float), vector])

    def start(self) -> NDArray[np.float64]:
        """Initial hidden states ``(n_states,)``."""
        if self.initial_state is None:
            return np.zeros(len(self.states))
        return np.array(self.initial_state, dtype=float)
