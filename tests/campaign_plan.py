"""The small campaign that tests of campaigns run: one carriage with a gap, and with hysteresis in half of the records."""

from __future__ import annotations

SDOF = {
    "rig": "sdof",
    "structure": {
        "mass": {"carriage": {"uniform": [1.0, 3.0]}},
        "stiffness": {"carriage": {"log_uniform": [500.0, 5000.0]}},
        "damping": {"carriage": {"uniform": [1.0, 5.0]}},
    },
    "elements": [
        {"law": "gap", "joints": ["carriage"], "parameters": {"clearance": {"uniform": [0.001, 0.004]}}},
        {
            "law": "bouc_wen",
            "joints": ["carriage"],
            "parameters": {"A": {"uniform": [300.0, 900.0]}, "n": {"choice": [1.0, 2.0]}},
            "probability": 0.5,
        },
    ],
}
NOISE = {
    "signals": {"shaker": {"type": "band_limited_noise", "cutoff": 60.0, "rms": {"uniform": [5.0, 20.0]}}}
}


def document(**changes) -> dict:
    return {
        "name": "test",
        "seed": 11,
        "records": 24,
        "duration": 0.25,
        "sample_rate": 1000.0,
        "records_per_part": 3,
        "rigs": [SDOF],
        "excitations": [NOISE],
        "sensors": [{"chains": {"displacement": [{"type": "noise", "std": {"log_uniform": [1e-6, 1e-4]}}]}}],
    } | changes
