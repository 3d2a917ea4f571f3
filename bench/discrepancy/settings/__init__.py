"""Thresholds of the diagnosis: frozen dataclasses, one a room, each value with its meaning and its reason."""

from bench.discrepancy.settings.articulated import (
    ArticulatedJudgementSettings,
    ArticulatedNextTestSettings,
    ArticulatedSearchSettings,
    ArticulatedSettings,
)
from bench.discrepancy.settings.case import CaseSettings
from bench.discrepancy.settings.checks import ChecksSettings, LikenessSettings, ScaleSettings
from bench.discrepancy.settings.describing import DescribedSetting, described, setting
from bench.discrepancy.settings.diagnosis import DEFAULT, DiagnosisSettings, changed, with_values
from bench.discrepancy.settings.document import SettingsDocument, read_settings, settings_of
from bench.discrepancy.settings.fitting import FittingSettings
from bench.discrepancy.settings.judgement import CoarseSettings, HeldOutSettings, JudgementSettings
from bench.discrepancy.settings.likelihood import ErrorSettings, LikelihoodSettings
from bench.discrepancy.settings.localisation import LocalisationSettings
from bench.discrepancy.settings.model import ModelSettings
from bench.discrepancy.settings.motion import MotionSettings, RecordMemorySettings
from bench.discrepancy.settings.next_test import NextTestSettings
from bench.discrepancy.settings.numerics import NumericsSettings
from bench.discrepancy.settings.response import ResponseSettings
from bench.discrepancy.settings.screening import ScreeningSettings
from bench.discrepancy.settings.search import SearchSettings
from bench.discrepancy.settings.search_parts import TimedForceSettings
from bench.discrepancy.settings.simulation import SimulationSettings

__all__ = [
    "DEFAULT",
    "ArticulatedJudgementSettings",
    "ArticulatedNextTestSettings",
    "ArticulatedSearchSettings",
    "ArticulatedSettings",
    "CaseSettings",
    "ChecksSettings",
    "CoarseSettings",
    "DescribedSetting",
    "DiagnosisSettings",
    "ErrorSettings",
    "FittingSettings",
    "HeldOutSettings",
    "JudgementSettings",
    "LikelihoodSettings",
    "LikenessSettings",
    "LocalisationSettings",
    "ModelSettings",
    "MotionSettings",
    "NextTestSettings",
    "NumericsSettings",
    "RecordMemorySettings",
    "ResponseSettings",
    "ScaleSettings",
    "ScreeningSettings",
    "SearchSettings",
    "SettingsDocument",
    "SimulationSettings",
    "TimedForceSettings",
    "changed",
    "described",
    "read_settings",
    "setting",
    "settings_of",
    "with_values",
]
