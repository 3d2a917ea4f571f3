"""How large a campaign would be, and whether that can be: asked before anything is allocated or written."""

from __future__ import annotations

import os
import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from bench.errors import ParameterError
from bench.files import OutputError

if TYPE_CHECKING:
    from bench.campaign.generation import Generator


@dataclass(frozen=True)
class SizeLimits:
    """What a campaign may ask for.

    Attributes:
        packed: Least share of the raw numbers that a data set takes on the disk. Noise-like channels in float32 take 0.7 of them
            (docs/scale.md); half is asked for, so that a plan is refused only where the disk is too small beyond doubt. One that
            fills it later stops with a message and is resumed.
        memory: Largest share of the machine's memory that the parts in the making may take.
    """

    packed: float = 0.5
    memory: float = 0.9


SIZE_LIMITS = SizeLimits()


def check_size(generator: Generator, folder: Path, *, at_once: int, limits: SizeLimits = SIZE_LIMITS) -> None:
    """Refuse a plan whose parts do not fit into the memory, or whose data set does not fit onto the disk.

    Args:
        generator: The plan's generator.
        folder: Folder of the data set, which need not exist; what it holds already counts as done.
        at_once: Parts made at the same time on this machine.
        limits: What may be asked for.

    Raises:
        ParameterError: A part does not fit into the memory; the message tells its size.
        OutputError: The data set does not fit onto the disk; the message tells its size.
    """
    plan = generator.plan
    part, memory = part_bytes(generator), memory_bytes()
    if memory and part * at_once > limits.memory * memory:
        raise ParameterError(
            f"a part of {min(plan.records_per_part, plan.records)} records of {plan.duration:g} s takes about {bytes_text(part)} while "
            f"it is made, and {at_once} at a time do not fit into the {bytes_text(memory)} of this machine; give shorter records, "
            "a longer timestep, a smaller records_per_part, or fewer threads"
        )
    raw = data_bytes(generator)
    nearest = next(parent for parent in (folder, *folder.parents) if parent.exists())
    there = sum(path.stat().st_size for path in folder.glob("*/part-*.parquet") if path.is_file())
    free = shutil.disk_usage(nearest).free
    if limits.packed * raw > free + there:
        raise OutputError(
            f"{plan.records} records of {plan.n_samples} samples in {len(generator.channels)} channels are {bytes_text(raw)}, which "
            f"do not fit into the {bytes_text(free)} that are free at {nearest} even if packed to "
            f"{100 * limits.packed:.0f} %; ask for fewer, or choose another disk"
        )


def data_bytes(generator: Generator) -> float:
    """Bytes of the numbers in a whole data set, before they are packed; those of the records' table are left out."""
    plan = generator.plan
    width = 4 if plan.precision == "float32" else 8
    return float(plan.records) * plan.n_samples * width * len(generator.channels)


def part_bytes(generator: Generator) -> float:
    """Bytes of memory that a part takes while it is made: what its batch records at every step, and its tables."""
    plan = generator.plan
    most = 0.0
    for rig in range(len(plan.rigs)):
        variant = generator.variants.full(rig)
        model = variant.rig.model
        inside = any(
            variant.sources[channel.name].item >= 0
            for channel in generator.channels
            if channel.name in variant.sources
        )
        state = 1 + model.nq + model.nv + model.na if inside else 0
        # commands are held by the record and by the batch, states by the batch and with the start before them
        most = max(most, (2 * model.nu + model.nsensordata + 2 * state) / variant.rig.timestep)
    width = 4 if plan.precision == "float32" else 8
    tables = 3 * (len(generator.channels) * width + 12) * float(plan.n_samples)  # values, columns, encoded
    return min(plan.records_per_part, plan.records) * (8.0 * most * plan.duration + tables)


def memory_bytes() -> float:
    """Memory of this machine, or of the group of processes that this one is confined to; 0 where the system does not tell."""
    try:
        whole = float(os.sysconf("SC_PHYS_PAGES")) * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError, OSError):
        return 0.0
    try:
        most = float(Path("/sys/fs/cgroup/memory.max").read_text(encoding="ascii"))
    except (OSError, ValueError):  # no such group, or "max"
        return whole
    return min(whole, most)


def bytes_text(size: float) -> str:
    """A number of bytes as people write it."""
    for unit in ("bytes", "kB", "MB", "GB"):
        if size < 1000.0:
            return f"{size:.3g} {unit}"
        size /= 1000.0
    return f"{size:.4g} TB"
