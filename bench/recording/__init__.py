"""Records of measured or simulated channels: the one currency of the bench.

Identification and diagnosis see nothing but recordings, so that laboratory files and simulations are interchangeable.
Reading and writing them is the business of `bench.record_files`.
"""

from bench.recording.channel import ROLES, Channel
from bench.recording.description import Recording
from bench.recording.scores import nmse, nrmse
from bench.recording.units import SI_UNITS

__all__ = ["ROLES", "SI_UNITS", "Channel", "Recording", "nmse", "nrmse"]
