"""Reduced-order joints as the command line has them: identified from records, kept in a file, put into a rig.

`registry` lists the kinds of models that a joint can be identified as; a further kind is one line there. `records` reads what a
laboratory measured into motions and restoring forces, `document` is the file between the commands.
"""

from bench.joint_models.document import JointFile, read_joint, write_joint
from bench.joint_models.records import JointColumns, joint_motions
from bench.joint_models.registry import KINDS, Fitted, JointKind, Settings, identify

__all__ = [
    "KINDS",
    "Fitted",
    "JointColumns",
    "JointFile",
    "JointKind",
    "Settings",
    "identify",
    "joint_motions",
    "read_joint",
    "write_joint",
]
