"""Dampers watched in service: what a period dissipates against what it should, and when that has changed.

`DamperMonitor` takes a record block by block. It learns on the first periods (adaptive least squares for C and n, then how much the
energies of single periods scatter about them), and afterwards asks after each period whether the damper is still the one it
learnt, with a threshold from the mean number of periods between false alarms. `bench.monitoring.study` counts both.
"""

from bench.monitoring.damper import DamperMonitor, monitor_record
from bench.monitoring.findings import Alarm, Baseline, MonitorSettings, PeriodJudged
from bench.monitoring.periods import Period, PeriodSplitter
from bench.monitoring.run_length import alarm_threshold, mean_run_length

__all__ = [
    "Alarm",
    "Baseline",
    "DamperMonitor",
    "MonitorSettings",
    "Period",
    "PeriodJudged",
    "PeriodSplitter",
    "alarm_threshold",
    "mean_run_length",
    "monitor_record",
]
