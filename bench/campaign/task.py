"""The task that threads, processes and clusters run: one part, from the plan as text."""

from __future__ import annotations

import json
import threading
from functools import lru_cache
from typing import TYPE_CHECKING, Any

from bench.campaign.lock import CampaignError
from bench.campaign.plan import Plan
from bench.campaign.reading import plan_from_dict
from bench.campaign.store import Store
from bench.campaign.versions import differing, versions

if TYPE_CHECKING:
    from bench.campaign.generation import Generator

_loading = threading.Lock()


def payload_of(plan: Plan) -> str:
    """A plan as text for another process."""
    document = {"plan": plan.to_dict(), "folder": plan.rigs[0].folder, "versions": versions()}
    return json.dumps(document, ensure_ascii=False)


def generator_of(payload: str) -> Generator:
    """The generator of a plan, made once a process."""
    with _loading:
        return _generator(payload)


@lru_cache(maxsize=2)
def _generator(payload: str) -> Generator:
    from bench.campaign.generation import Generator  # noqa: PLC0415  (MuJoCo and the compiled code)

    document = json.loads(payload)
    different = differing(versions(), document["versions"])
    if different:  # a worker that joined later
        raise CampaignError(f"a worker has {different}; install the same versions everywhere")
    return Generator(plan_from_dict(document["plan"], folder=document["folder"]))


def run_part(payload: str, folder: str, part: int, threads: int = 1) -> dict[str, Any]:
    """Generate and write one part; the task that threads, processes and clusters run.

    Args:
        payload: The plan, as from `payload_of`.
        folder: Folder of the campaign.
        part: Number of the part.
        threads: Threads of its native batches.

    Returns:
        Its entry in the manifest.
    """
    from bench.campaign.tables import part_contents  # noqa: PLC0415

    generator = generator_of(payload)
    made = generator.part(part, threads=threads)
    failed = [failure.record for failure in made.failures]
    return Store(folder).write_part(generator.plan, part, failed, part_contents(generator, made))
