"""Reading plans: TOML or JSON documents, checked by `bench.campaign.schema`.

```toml
name = "gap and hysteresis"
seed = 2006
records = 10_000
duration = 10.0                     # [s]
sample_rate = 1000.0                # [Hz]
sampling = "sobol"                  # or "random", "latin_hypercube"
channels = ["shaker", "displacement", "acceleration"]

[[rigs]]                            # entries as in a rig configuration, with distributions for numbers
rig = "sdof"
structure.mass.carriage = { uniform = [1.5, 2.5] }
[[rigs.elements]]
law = "gap"
joints = ["carriage"]
parameters = { stiffness = { log_uniform = [1e3, 1e4] }, clearance = 0.003 }
probability = 0.5                   # half of the records have it
withheld = true                     # and the manifest does not say which

[[excitations]]
signals.shaker = { type = "band_limited_noise", cutoff = 40.0, rms = { log_uniform = [5.0, 50.0] } }

[[sensors]]
chains.displacement = [{ type = "noise", std = 1e-5 }]
```
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from bench.campaign.plan import Plan


def read_plan(path: str | Path) -> Plan:
    """Read a plan from a TOML or JSON file.

    Raises:
        FileFormatError: It cannot be read, or is neither.
        DocumentError: An entry, distribution, law, signal or stage is not known, missing, of the wrong kind or out of range.
    """
    from bench.campaign.schema import PlanDocument  # noqa: PLC0415  (pydantic, for those who read documents)
    from bench.documents import checked, load_document, naming  # noqa: PLC0415

    file = Path(path)
    document = load_document(file)
    with naming(str(file)):
        return checked(PlanDocument, {"name": file.stem} | document, str(file)).plan(file.parent)


def plan_from_dict(document: Mapping[str, Any], *, folder: str | Path = ".") -> Plan:
    """The plan that a document stands for.

    Args:
        document: Entries as in the module's example.
        folder: Folder that MJCF paths are relative to.

    Raises:
        DocumentError: An entry, distribution, law, signal or stage is not known, missing, of the wrong kind or out of range.
        ParameterError: The parts of the plan do not fit one another.
    """
    from bench.campaign.schema import PlanDocument  # noqa: PLC0415
    from bench.documents import checked  # noqa: PLC0415

    return checked(PlanDocument, document).plan(folder)
