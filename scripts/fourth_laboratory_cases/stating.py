"""What is stated of a case: nominal values off by their uncertainty, and the channels."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from fourth_laboratory_cases.case import Case

FARTHEST = 1.6
"""Stated standard deviations by which a nominal value is off at most."""


def drawn(case: Case, rng: np.random.Generator) -> dict[str, float]:
    """Nominal values of the parameters, by name, in SI units."""
    truth = case.specimen.stated_values()
    return {
        name: truth[p.of] * (1 + p.relative * float(np.clip(rng.standard_normal(), -FARTHEST, FARTHEST)))
        for name, p in case.parameters.items()
    }


def stated(case: Case, nominal: Mapping[str, float], levels: Mapping[str, float]) -> dict[str, Any]:
    """Content of `nominal.json`, from nominal values and noise of the channels, both in SI units."""
    truth = case.specimen.stated_values()
    parameters = {
        name: {
            "value": float(f"{nominal[name] * p.scale:.5g}"),
            "std": float(f"{abs(truth[p.of]) * p.relative * p.scale:.3g}"),
            "unit": p.unit,
        }
        for name, p in case.parameters.items()
    }
    channels: dict[str, dict[str, Any]] = {"time": {"unit": "s"}}
    for name, channel in case.channels.items():
        channels[name] = {"unit": channel.unit, **channel.told}
        if case.understated is not None:
            channels[name]["noise_std"] = float(f"{levels[name] * channel.scale / case.understated:.3g}")
    return {"rig": case.rig, "parameters": parameters, "channels": channels, **case.told}
