"""Mutates what the bench reads and holds every reader to one rule: it takes the input, or raises a `BenchError` of one line.

    python scripts/fuzz.py --n 5000              # spread over all targets
    python scripts/fuzz.py --n 500 --target plan --seed 7

It takes at most 20 s and 2 GB about it, and leaves no file behind. Every target is worked through in a process of its own, which
is watched: one that hangs or crashes is a violation, and the next goes on after it. Inputs that break the rule are kept in the
folder named by --keep.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import resource
import select
import shutil
import signal
import sys
import tempfile
import time
import traceback
import zlib
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import NamedTuple

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent))

from fuzzing.documents import TARGETS as DOCUMENTS
from fuzzing.documents import Target
from fuzzing.products import PRODUCT_TARGETS
from fuzzing.records import RECORD_TARGETS

from bench.errors import BenchError
from bench.files import write_text

TARGETS: dict[str, Target] = {**DOCUMENTS, **RECORD_TARGETS, **PRODUCT_TARGETS}
"""Targets by name."""

SECONDS = 20
MEGABYTES = 2000
SPARE = 6 * 2**30
"""Address space beyond what a worker has at its start; what asks for more gets a MemoryError instead of the machine."""
WARM = 300
"""Seconds that a worker may take to import what it needs and to read sound inputs."""
MAKES_FILES = ("manifest", "parts")
"""Targets that write beside what they read, as they should."""


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
    except BaseException as error:
        place = traceback.extract_tb(error.__traceback__)[-1]
        return f"{type(error).__name__} at {Path(place.filename).name}:{place.lineno}: {error}"
    finally:
        signal.alarm(0)
    return ""


def _late(*_: object) -> None:
    raise _Late


def _peak(reset: bool = False) -> float:
    """Largest memory of this process since the last reset [MB]."""
    if reset:
        with contextlib.suppress(OSError):
            Path("/proc/self/clear_refs").write_text("5")
        return 0.0
    with contextlib.suppress(OSError, StopIteration):
        lines = Path("/proc/self/status").read_text().splitlines()
        return int(next(line for line in lines if line.startswith("VmHWM")).split()[1]) / 1024.0
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0


def _work(name: str, first: int, n: int, seed: int, keep: Path | None, made: Path, out: int) -> None:
    """Spoil and read from the `first` mutation on, and write a line about each: in a process of its own."""
    target = TARGETS[name]
    sound, spoilt = made / "sound", made / "spoilt"
    if not sound.exists():
        sound.mkdir()
        target.make(sound)
    target.read(shutil.copytree(sound, made / "tried", dirs_exist_ok=True))
    virtual = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (virtual + SPARE, resource.RLIM_INFINITY))
    os.write(out, b"ready\n")
    held = _peak()
    for number in range(first, n):
        rng = np.random.default_rng([seed, zlib.crc32(name.encode()), number])
        shutil.rmtree(spoilt, ignore_errors=True)
        shutil.copytree(sound, spoilt)
        target.spoil(spoilt, rng)
        kept = {path: path.read_bytes() for path in spoilt.rglob("*") if path.is_file()}
        if keep is not None:  # before it is read: a crash leaves no time for it
            _keep(kept, spoilt, keep / name / str(number), "did not return")
        _peak(reset=True)
        what = attempt(target, spoilt)
        taken = _peak() - held
        if not what and taken > MEGABYTES:
            what = f"{taken:.0f} MB"
        left = [path.name for path in spoilt.rglob("*") if path.is_file() and path not in kept]
        if not what and left and name not in MAKES_FILES:
            what = f"left {left[0]} behind"
        if keep is not None:
            if what:
                (keep / name / str(number) / "WHY.txt").write_text(what, encoding="utf-8", errors="replace")
            else:
                shutil.rmtree(keep / name / str(number))
        os.write(out, json.dumps([number, what[:2000]]).encode() + b"\n")


def run(name: str, n: int, seed: int, keep: Path | None = None) -> list[Broken]:
    """Spoil and read the inputs of a target `n` times.

    Args:
        name: Name of the target.
        n: Mutations.
        seed: Seed.
        keep: Folder for inputs that break the rule.
    """
    broken: list[Broken] = []
    first = 0
    with tempfile.TemporaryDirectory() as made:
        while first < n:
            reached, ready, end = first, False, ""
            for line in _watched(name, first, n, seed, keep, Path(made)):
                if line == "ready":
                    ready = True
                elif line.startswith("["):
                    reached, what = json.loads(line)
                    reached += 1
                    if what:
                        broken.append(Broken(name, reached - 1, what))
                else:
                    end = line
            if not ready:
                raise RuntimeError(f"target '{name}' does not read its own sound inputs: {end}")
            if end:
                broken.append(Broken(name, reached, end))
                reached += 1
            first = reached
    return broken


def _watched(name: str, first: int, n: int, seed: int, keep: Path | None, made: Path) -> Iterator[str]:
    """Lines of a worker; the last says how it ended, if not well."""
    reading, writing = os.pipe()
    worker = os.fork()
    if worker == 0:
        os.close(reading)
        code = 1
        with contextlib.suppress(BaseException):
            try:
                _work(name, first, n, seed, keep, made, writing)
                code = 0
            except BaseException:
                traceback.print_exc()
        os._exit(code)
    os.close(writing)
    rest, wait, hung = b"", WARM, False
    while True:
        if not select.select([reading], [], [], wait)[0]:
            hung = True
            os.kill(worker, signal.SIGKILL)
            break
        chunk = os.read(reading, 65536)
        if not chunk:
            break
        *lines, rest = (rest + chunk).split(b"\n")
        yield from (line.decode() for line in lines)
        wait = SECONDS + 10
    os.close(reading)
    status = os.waitpid(worker, 0)[1]
    if hung:
        yield f"more than {SECONDS} s, where no signal gets through"
    elif os.WIFSIGNALED(status):
        yield f"killed by signal {os.WTERMSIG(status)}"
    elif os.WEXITSTATUS(status):
        yield f"ended with {os.WEXITSTATUS(status)}"


def _keep(files: dict[Path, bytes], root: Path, folder: Path, what: str) -> None:
    for path, content in files.items():
        place = folder / path.relative_to(root)
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_bytes(content)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "WHY.txt").write_text(what, encoding="utf-8", errors="replace")


def main() -> int:
    """Run the command line."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0] if __doc__ else "")
    parser.add_argument("--n", type=int, default=1000, help="mutations, over all targets")
    parser.add_argument(
        "--target", choices=sorted(TARGETS), action="append", help="one target; all by default"
    )
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=2, help="targets that are worked through at once")
    parser.add_argument("--keep", type=Path, help="folder for inputs that break the rule")
    parser.add_argument("--json", type=Path, help='file for the result; "-" prints it')
    args = parser.parse_args()
    names = args.target or list(TARGETS)
    n = -(-args.n // len(names))
    printed = args.json == Path("-")

    def worked(name: str) -> list[Broken]:
        start = time.perf_counter()
        found = run(name, n, args.seed, args.keep)
        if not printed:
            seconds = time.perf_counter() - start
            print(f"{name:12} {n} mutations, {len(found)} break the rule, {seconds:.1f} s", flush=True)
        return found

    with ThreadPoolExecutor(args.jobs) as pool:
        broken = [row for rows in pool.map(worked, names) for row in rows]
    document = {
        "seed": args.seed,
        "mutations": dict.fromkeys(names, n),
        "broken": [row._asdict() for row in broken],
    }
    if printed:
        print(json.dumps(document, indent=1))
        return 1 if broken else 0
    if args.json is not None:
        write_text(args.json, json.dumps(document, indent=1))
    for row in broken:
        print(f"{row.target} {row.number}: {row.what[:300]}")
    return 1 if broken else 0


if __name__ == "__main__":
    sys.exit(main())
