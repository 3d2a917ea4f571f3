"""All cases of the third laboratory."""

from __future__ import annotations

from third_laboratory_cases.clean import CLEAN
from third_laboratory_cases.foreign import FOREIGN
from third_laboratory_cases.joints import JOINTS
from third_laboratory_cases.loggers import LOGGERS
from third_laboratory_cases.machines import MACHINES
from third_laboratory_cases.scheduled import SCHEDULED
from third_laboratory_cases.timed import TIMED

CASES = (*JOINTS, *SCHEDULED, *LOGGERS, *MACHINES, *TIMED, *CLEAN, *FOREIGN)
