"""An element: a force law placed in a structure.

The same type is the true joint, a candidate effect with free parameters, and the identified reduced-order joint.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bench.errors import ParameterError
from bench.laws import find_law
from bench.laws.base import ForceLaw


class Validity(Protocol):
    """The range of states that a reduced-order model was identified on."""

    def outside(self, states: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Mask ``(n,)`` of the states ``(n, 2 n_coordinates)`` (positions, then velocities) outside the range."""
        ...


@dataclass(frozen=True, eq=False)
class Element:
    """A force law, the joints it acts on, and its parameters.

    Attributes:
        law: The force law.
        joints: Names of the joints or fixed tendons that are its coordinates, in the order of the law.
        theta: Header and parameters, checked against the law's bounds ``(n_theta,)``, read-only.
        inputs: Names of the actuators whose controls the law reads, for laws with inputs.
        name: Name in the model and in channels; by default the joints' and the law's, "carriage.gap".
        exact: Coulomb friction by MuJoCo's own constraint (`frictionloss`), which sticks; otherwise the kernel.
        validity: The range that a reduced-order model was identified on; simulations warn when they leave it.

    Example:
        >>> Element.of("gap", "carriage", stiffness=2000.0, clearance=0.005).name
        'carriage.gap'
    """

    law: ForceLaw
    joints: tuple[str, ...]
    theta: NDArray[np.float64]
    inputs: tuple[str, ...] = ()
    name: str = ""
    exact: bool = False
    validity: Validity | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        expected = self.law.n_coordinates - self.law.n_inputs
        if len(self.joints) != expected or len(self.inputs) != self.law.n_inputs:
            raise ParameterError(
                f"law '{self.law.name}' acts on {expected} joint(s) and reads {self.law.n_inputs} input(s); "
                f"joints {list(self.joints)} and inputs {list(self.inputs)} came"
            )
        if self.exact and self.law.name != "coulomb":
            raise ParameterError(
                f"exact stick is MuJoCo's frictionloss, which is Coulomb friction; law '{self.law.name}' has no exact form: "
                "leave exact=False (its regularisation error is stated with the law)"
            )
        theta = self.law.theta(self.theta)
        theta.flags.writeable = False
        object.__setattr__(self, "theta", theta)
        object.__setattr__(self, "joints", tuple(self.joints))
        object.__setattr__(self, "inputs", tuple(self.inputs))
        if not self.name:
            object.__setattr__(self, "name", f"{'+'.join(self.joints)}.{self.law.name}")

    @classmethod
    def of(
        cls,
        law: str | ForceLaw,
        *joints: str,
        theta: ArrayLike | None = None,
        inputs: tuple[str, ...] = (),
        name: str = "",
        exact: bool = False,
        **parameters: float,
    ) -> Element:
        """Make an element from the law's name, its joints and its parameters.

        Args:
            law: Name in `bench.laws.LAWS`, or a law.
            *joints: Joints or fixed tendons.
            theta: All parameters in order; or None to name them.
            inputs: Actuators that the law reads.
            name: Name of the element.
            exact: See the class.
            **parameters: Parameters by name, the others at their defaults.

        Raises:
            UnknownNameError: No such law, or no such parameter.
            ParameterError: Wrong number of joints or parameters, or a value out of bounds.
        """
        found = find_law(law) if isinstance(law, str) else law
        return cls(found, joints, found.theta(theta, **parameters), inputs=inputs, name=name, exact=exact)

    def with_(self, **changes: Any) -> Element:
        """A copy with other fields, or with other parameters by name."""
        own = {key: changes.pop(key) for key in list(changes) if key in self.__dataclass_fields__}
        theta = self.law.theta(own.pop("theta", self.theta), **changes)
        return replace(self, theta=theta, **own)

    @property
    def parameters(self) -> Mapping[str, float]:
        """Parameters by name, without the header."""
        values = self.theta[len(self.law.header) :]
        return dict(zip(self.law.parameter_names, (float(value) for value in values), strict=True))

    def to_dict(self) -> dict[str, Any]:
        """JSON form; laws outside the registry are given by name, header and theta."""
        return {
            "law": self.law.name,
            "header": list(self.law.header),
            "joints": list(self.joints),
            "inputs": list(self.inputs),
            "theta": [float(value) for value in self.theta[len(self.law.header) :]],
            "name": self.name,
            "exact": self.exact,
        }

    @classmethod
    def from_dict(cls, document: Mapping[str, Any]) -> Element:
        """Read the JSON form of an element whose law is in the registry.

        Raises:
            DocumentError: The law is not in the registry, or an entry is not known, missing, of the wrong kind or out of range.
        """
        from bench.documents import checked, schema_of  # noqa: PLC0415  (pydantic, for those who read documents)

        return checked(schema_of("bench.rig").ElementDocument, document).element()
