"""Campaigns: many records drawn from a plan, on many cores or machines, as a data set that common tools read.

`run_campaign` runs a plan into a folder, `Windows` reads it back in shuffled windows of fixed memory, `verify` compares
it with its hashes, `write_minari` stores rollouts of a policy.
"""

from bench.campaign.alternatives import ElementPlan, ExcitationPlan, RigPlan, SensorPlan
from bench.campaign.distribution import Choice, Distribution, Integers, LogUniform, Normal, Shared, Uniform
from bench.campaign.execution import CampaignResult, Progress, run_campaign
from bench.campaign.lock import CampaignError
from bench.campaign.plan import Plan
from bench.campaign.reading import plan_from_dict, read_plan
from bench.campaign.rollouts import Rollout, collect, write_minari
from bench.campaign.verifying import verify
from bench.campaign.windows import Window, Windows

__all__ = [
    "CampaignError",
    "CampaignResult",
    "Choice",
    "Distribution",
    "ElementPlan",
    "ExcitationPlan",
    "Integers",
    "LogUniform",
    "Normal",
    "Plan",
    "Progress",
    "RigPlan",
    "Rollout",
    "SensorPlan",
    "Shared",
    "Uniform",
    "Window",
    "Windows",
    "collect",
    "plan_from_dict",
    "read_plan",
    "run_campaign",
    "verify",
    "write_minari",
]
