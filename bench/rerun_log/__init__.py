"""Rigs and records in the rerun viewer: motion in 3-D, channels, hysteresis loops, contact and slip, errors.

`log_comparison` writes one ``.rrd`` file (or opens the viewer) with everything laid out; `log_episode` one of a rig that is
excited within limits. Rerun's time line is "time",
in seconds of the record.
"""

from bench.rerun_log.bands import GAP, REGION, Band
from bench.rerun_log.comparison import log_comparison
from bench.rerun_log.episode import log_episode
from bench.rerun_log.kinematics import body_poses, joint_positions

__all__ = ["GAP", "REGION", "Band", "body_poses", "joint_positions", "log_comparison", "log_episode"]
