"""All settings of a diagnosis."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, is_dataclass, replace
from typing import Any

from bench.discrepancy.settings.articulated import ArticulatedSettings
from bench.discrepancy.settings.case import CaseSettings
from bench.discrepancy.settings.checks import ChecksSettings
from bench.discrepancy.settings.describing import setting
from bench.discrepancy.settings.fitting import FittingSettings
from bench.discrepancy.settings.judgement import JudgementSettings
from bench.discrepancy.settings.likelihood import LikelihoodSettings
from bench.discrepancy.settings.localisation import LocalisationSettings
from bench.discrepancy.settings.model import ModelSettings
from bench.discrepancy.settings.motion import MotionSettings
from bench.discrepancy.settings.next_test import NextTestSettings
from bench.discrepancy.settings.numerics import NumericsSettings
from bench.discrepancy.settings.response import ResponseSettings
from bench.discrepancy.settings.screening import ScreeningSettings
from bench.discrepancy.settings.search import SearchSettings
from bench.discrepancy.settings.simulation import SimulationSettings


@dataclass(frozen=True)
class DiagnosisSettings:
    """Thresholds of a diagnosis, by the room that uses them; docs/thresholds.md lists them all.

    They travel with what the rooms receive: `Problem.settings`, `Fit.settings`, `Explanation.settings`.
    """

    seed: int = setting(
        20060501,
        "Seed of draws and bootstraps where no generator is given.",
        "A diagnosis repeats exactly; any other number serves as well.",
    )
    budget: float = setting(
        600.0,
        "Seconds after which no further stage of a search is begun, where `--budget` does not say.",
        "From a log to a corrected model it is to take ten minutes; few cases take more than two.",
        unit="s",
    )
    case: CaseSettings = field(default_factory=CaseSettings)
    model: ModelSettings = field(default_factory=ModelSettings)
    simulation: SimulationSettings = field(default_factory=SimulationSettings)
    motion: MotionSettings = field(default_factory=MotionSettings)
    response: ResponseSettings = field(default_factory=ResponseSettings)
    likelihood: LikelihoodSettings = field(default_factory=LikelihoodSettings)
    numerics: NumericsSettings = field(default_factory=NumericsSettings)
    fitting: FittingSettings = field(default_factory=FittingSettings)
    checks: ChecksSettings = field(default_factory=ChecksSettings)
    screening: ScreeningSettings = field(default_factory=ScreeningSettings)
    search: SearchSettings = field(default_factory=SearchSettings)
    judgement: JudgementSettings = field(default_factory=JudgementSettings)
    localisation: LocalisationSettings = field(default_factory=LocalisationSettings)
    next_test: NextTestSettings = field(default_factory=NextTestSettings)
    articulated: ArticulatedSettings = field(default_factory=ArticulatedSettings)


DEFAULT = DiagnosisSettings()
"""The settings where nothing else is asked for."""


def changed(settings: Any, default: Any = DEFAULT) -> dict[str, Any]:
    """What differs from the default, as nested tables of JSON values; a file of them gives the same settings again.

    Args:
        settings: Settings.
        default: What they are compared with, of the same class.
    """
    out: dict[str, Any] = {}
    for entry in fields(settings):
        value, usual = getattr(settings, entry.name), getattr(default, entry.name)
        if value == usual:
            continue
        if is_dataclass(value):
            out[entry.name] = changed(value, usual)
        else:
            out[entry.name] = list(value) if isinstance(value, tuple) else value
    return out


def with_values(settings: Any, values: Mapping[str, Any]) -> Any:
    """Settings with some values replaced.

    Args:
        settings: Settings.
        values: Nested tables of values by the names of fields, as `changed` gives them.
    """
    new: dict[str, Any] = {}
    for name, value in values.items():
        own = getattr(settings, name)
        if is_dataclass(own):
            new[name] = with_values(own, value)
        else:
            new[name] = tuple(value) if isinstance(own, tuple) else value
    return replace(settings, **new)
