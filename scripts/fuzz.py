"""Mutates what the bench reads and holds every reader to one rule: it takes the input, or raises a `BenchError` of one line.

    python scripts/fuzz.py --n 5000              # spread over all targets
    python scripts/fuzz.py --n 500 --target plan --seed 7

It takes at most 20 s and 2 GB about it. Inputs that break the rule are kept in the folder named by --keep.
"""

from __future__ import annotations

import argparse
import resource
import shutil
import signal
import sys
import tempfile
import time
import traceback
import zlib
from pathlib import Path
from typing import NamedTuple

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent))

from fuzzing.documents import TARGETS, Target

from bench.errors import BenchError

SECONDS = 20
MEGABYTES = 2000


class Broken(NamedTuple):
    """A violation: the target, the number of the mutation, and what happened."""

    target: str
    number: int
    what: str


class _Late(BaseException):
    """The time is over; no `Exception`, so that no reader takes it for one of its own."""


def attempt(target: Target, folder: Path) -> str:
    """Read spoilt inputs once; what broke the rule, or nothing."""
    signal.signal(signal.SIGALRM, _late)
    signal.alarm(SECONDS)
    try:
        target.read(folder)
    except BenchError as error:
        return "" if "\n" not in str(error) else f"a message of several lines: {str(error)!r}"
    except _Late:
        return f"more than {SECONDS} s"
    except Exception as error:
        place = traceback.extract_tb(error.__traceback__)[-1]
        return f"{type(error).__name__} at {Path(place.filename).name}:{place.lineno}: {error}"
    finally:
        signal.alarm(0)
    return ""


def _late(*_: object) -> None:
    raise _Late


def run(name: str, n: int, seed: int, keep: Path | None = None) -> list[Broken]:
    """Spoil and read the inputs of a target `n` times."""
    target, broken = TARGETS[name], []
    with tempfile.TemporaryDirectory() as made:
        sound, spoilt = Path(made) / "sound", Path(made) / "spoilt"
        sound.mkdir()
        target.make(sound)
        target.read(sound)
        for number in range(n):
            rng = np.random.default_rng([seed, zlib.crc32(name.encode()), number])
            shutil.rmtree(spoilt, ignore_errors=True)
            shutil.copytree(sound, spoilt)
            target.spoil(spoilt, rng)
            kept = {path: path.read_bytes() for path in spoilt.rglob("*") if path.is_file()}
            before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
            what = attempt(target, spoilt)
            after = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
            if not what and after > max(before, 1000 * MEGABYTES):
                what = f"{after // 1000} MB"
            if what:
                broken.append(Broken(name, number, what))
                if keep is not None:
                    _keep(kept, spoilt, keep / name / str(number), what)
    return broken


def _keep(files: dict[Path, bytes], root: Path, folder: Path, what: str) -> None:
    for path, content in files.items():
        place = folder / path.relative_to(root)
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_bytes(content)
    (folder / "WHY.txt").write_text(what, encoding="utf-8", errors="replace")


def main() -> int:
    """Run the command line."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0] if __doc__ else "")
    parser.add_argument("--n", type=int, default=1000, help="mutations, over all targets")
    parser.add_argument(
        "--target", choices=sorted(TARGETS), action="append", help="one target; all by default"
    )
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--keep", type=Path, help="folder for inputs that break the rule")
    args = parser.parse_args()
    names = args.target or list(TARGETS)
    broken: list[Broken] = []
    for name in names:
        start = time.perf_counter()
        n = -(-args.n // len(names))
        found = run(name, n, args.seed, args.keep)
        broken += found
        print(
            f"{name:12} {n} mutations, {len(found)} break the rule, {time.perf_counter() - start:.1f} s",
            flush=True,
        )
    for row in broken:
        print(f"{row.target} {row.number}: {row.what[:300]}")
    return 1 if broken else 0


if __name__ == "__main__":
    sys.exit(main())
