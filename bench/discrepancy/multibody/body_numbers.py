"""Numbers of bodies as an explanation has them: what uncertain ones are changed by, and what the model leaves out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from bench.discrepancy.multibody.model import ArticulatedModel


class BodyNumbers(NamedTuple):
    """What of bodies is not as the model has it.

    Attributes:
        changed: Body with uncertain numbers to what they are changed by, see `BodyTerms.change`.
        missing: Bodies, each with what the model leaves out there: a "payload" [kg], the "share" of its weight that something else
            carries, or a shift of its centre of mass [m] along each axis; and the base with the angles by which it leans [rad].
    """

    changed: Mapping[str, Mapping[str, float]]
    missing: Sequence[tuple[str, Mapping[str, float]]] = ()

    def of_inertia(self) -> BodyNumbers:
        """Those that are masses and where they lie, the base with them."""
        return self._replace(missing=[item for item in self.missing if "share" not in item[1]])

    def put_into(self, model: ArticulatedModel) -> ArticulatedModel:
        """A model with these masses, on this base."""
        for body, by in self.changed.items():
            for kind, change in by.items():
                model = model.with_body(kind, body, model.body_value(kind, body) + change)
        for body, values in self.of_inertia().missing:
            if "payload" in values:
                model = model.with_payload(body, values["payload"])
            elif "tilt_x" in values:
                model = model.with_tilt(*values.values())
            else:
                model = model.with_centre(body, np.array(list(values.values())))
        return model
