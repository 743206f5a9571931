"""python -m tests.mutations --count 1000             cases of all kinds, and a summary of their faults
python -m tests.mutations mesh --count 1000        of one kind
python -m tests.mutations mesh 17 --keep FOLDER    one case again, with its files kept
"""

from __future__ import annotations

import argparse
import contextlib
import os
import re
import time
from collections import defaultdict

from tests.mutations.runner import Runner, run_all, share
from tests.mutations.verdict import Verdict


def main() -> None:
    parser = argparse.ArgumentParser(
        "tests.mutations", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("kind", nargs="?")
    parser.add_argument("seed", nargs="?", type=int)
    parser.add_argument("--keep", default="", help="folder for the files of the case; it is emptied before")
    parser.add_argument("--count", type=int, default=300, help="of all kinds")
    parser.add_argument("--first", type=int, default=1, help="first seed of each kind")
    parser.add_argument("--runners", type=int, default=len(os.sched_getaffinity(0)))
    given = parser.parse_args()
    if given.seed is not None:
        runner = Runner()
        print(runner.run(given.kind, given.seed, os.path.abspath(given.keep) if given.keep else ""))
        runner.close()
        return
    began = time.monotonic()
    cases = [case for case in share(given.count, given.first) if given.kind in (None, case[0])]
    verdicts: list[Verdict] = []
    with contextlib.suppress(KeyboardInterrupt):
        for verdict in run_all(cases, given.runners):
            verdicts.append(verdict)
    print(summary(verdicts))
    print(f"{len(verdicts)} of {len(cases)} cases in {time.monotonic() - began:.0f} s")


def summary(verdicts: list[Verdict]) -> str:
    """One line for each fault, with how often it came and the seeds of the first few; then how all ended."""
    groups: defaultdict[tuple[str, ...], list[Verdict]] = defaultdict(list)
    for verdict in verdicts:
        if verdict.faults:
            where = ":".join(verdict.place.split(":")[:2])
            groups[verdict.kind, re.sub(r"\d+", "#", verdict.faults[0]), where].append(verdict)
    lines = []
    for (kind, _, _), found in sorted(groups.items(), key=lambda group: (group[0][0], -len(group[1]))):
        seeds = " ".join(str(verdict.seed) for verdict in found[:6])
        told = next((line for line in reversed(found[0].err.splitlines()) if "rror" in line), "")[:200]
        lines.append(f"{len(found):4d}  {kind} | {found[0].faults[0]} | {found[0].place} | seeds {seeds} | {told}")
    codes = [verdict.code for verdict in verdicts]
    bad = sum(bool(verdict.faults) for verdict in verdicts)
    slowest, largest = max(verdict.seconds for verdict in verdicts), max(verdict.megabytes for verdict in verdicts)
    lines.append(
        f"{codes.count(0)} accepted, {codes.count(2)} refused, {bad} faulty; at most {slowest} s, {largest} MB"
    )
    return "\n".join(lines)


if __name__ == "__main__":
    main()
