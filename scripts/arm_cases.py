"""Diagnose a folder of cases on articulated models, one after another, and write one verdict a case.

    python scripts/arm_cases.py CASES RESULTS [--only arm2 leg3-037 …] [--again]

CASES holds one folder a case (`nominal.json`, records, MJCF), RESULTS gets `NAME.json` and a line in `ladders.txt`. Cases that already
have a result are skipped, so that a run can be stopped and taken up again. Seconds in `ladders.txt` are those of the processor (all
threads). `jointbench blind score RESULTS ANSWERS` scores them.
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path

from threadpoolctl import threadpool_limits

from bench.discrepancy import read_case
from bench.discrepancy.articulated.diagnosis import ArticulatedDiagnosis, diagnose_articulated
from bench.discrepancy.articulated_judgement.judgement import ladder
from bench.errors import BenchError
from bench.files import write_text


def told(found: ArticulatedDiagnosis) -> str:
    """The verdict and the ladder behind it in two lines."""
    verdict = found.verdict
    named = [
        (e.name, e.where, round(e.closed, 3), {k: float(f"{x.value:.3g}") for k, x in e.parameters.items()})
        for e in verdict.named
    ]
    rungs = [
        (r.hypothesis[-1].key if r.hypothesis else "", r.reduced.round(2).tolist())
        for r in ladder(found.problem, found.fits)
    ]
    gaps = [f"{g.before:.3g}>{g.after:.3g}/{g.noise_floor:.3g}" for g in verdict.gaps]
    return (
        f"{verdict.verdict} {named} {verdict.indistinguishable} complete {verdict.complete}\n"
        f"    {rungs} {gaps}"
    )


def main() -> None:
    """Run the cases."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("cases", type=Path)
    parser.add_argument("results", type=Path)
    parser.add_argument(
        "--only", nargs="*", default=[""], help="beginnings of names, in the order in which they are run"
    )
    parser.add_argument("--again", action="store_true", help="cases that have a result, too")
    options = parser.parse_args()
    options.results.mkdir(parents=True, exist_ok=True)
    folders = sorted(path.parent for path in options.cases.glob("*/nominal.json"))
    for folder in [f for start in options.only for f in folders if f.name.startswith(start)]:
        answer = options.results / f"{folder.name}.json"
        if answer.is_file() and not options.again:
            continue
        began = time.process_time()
        try:
            with threadpool_limits(1, user_api="blas"):
                found = diagnose_articulated(read_case(folder))
        except BenchError as error:
            print(f"{folder.name}: {error}", flush=True)
            continue
        used = time.process_time() - began
        write_text(answer, json.dumps(found.verdict.to_json(), indent=1))
        line = f"{folder.name}: {told(found)} {used:.0f} s of processor"
        print(line, flush=True)
        with (options.results / "ladders.txt").open("a") as file:
            file.write(line + "\n")


if __name__ == "__main__":
    main()
