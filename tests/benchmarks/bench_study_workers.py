"""What a second process gives a study, in processor seconds, so that a machine at other work can tell as well.

    python tests/benchmarks/bench_study_workers.py [study] [folder]      default: quick

The study is run by one process and by two. Its tasks, with the seconds that the serial run took for each, are then
dealt out to two workers, round by round: as if a search asked for its next cells only when a round is over, which is
no better than what the driver does. The rest of the serial run (start, what is next, tables, page) is done by the
driver alone, and half of what two processes take beside it (each starts, and loads kernels) comes on top. Bar: 0.85 of
two times as fast, and the same table.
"""

from __future__ import annotations

import heapq
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from studio.study.cells import next_cells
from studio.study.store import Row, Store, described
from studio.study.tables import CALIBRATING, SECONDS
from studio.study.tasks import tasks

ROOT = Path(__file__).resolve().parents[2]
BAR = 0.85
TABLES = ("table.csv", "table.parquet")


def processor_seconds(study: str, out: Path, workers: int) -> float:
    """Of the whole command and the processes that it starts."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    words = ["study", "run", study, "--out", str(out), "--workers", str(workers), "--quiet"]
    subprocess.run([sys.executable, str(ROOT / "main.py"), *words], check=True, stdout=subprocess.DEVNULL, cwd=ROOT)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def rounds(out: Path) -> list[list[float]]:
    """Seconds of every task of a finished study, by rounds of the driver, in its order."""
    study, bases = described(out)
    with Store(out, None) as store:
        measured = store.rows()
    known: dict[str, Row] = {}
    kept, found = set[str](), []
    while work := tasks(next_cells(study, bases, known), study.image_scale, study.laser):
        seconds = []
        for task in work:
            rows = [measured[cell.key] for cell in task.cells]
            each = sum(row.get(name, 0.0) for row in rows for name in (*SECONDS[1:], CALIBRATING))
            again = bool(task.again) and task.again in kept  # told the seconds of its first time
            kept.add(task.again)
            seconds.append(each if again else each + rows[0].get(SECONDS[0], 0.0))
            known |= {cell.key: row for cell, row in zip(task.cells, rows, strict=True)}
        found.append(seconds)
    return found


def makespan(seconds: list[float], workers: int) -> float:
    """Until the last of a round is done, each worker taking the next as it is free."""
    free = [0.0] * workers
    for one in seconds:
        heapq.heappush(free, heapq.heappop(free) + one)
    return max(free)


def main() -> int:
    study = sys.argv[1] if len(sys.argv) > 1 else "quick"
    with tempfile.TemporaryDirectory() as name:
        folder = Path(sys.argv[2]) if len(sys.argv) > 2 else Path(name)
        alone, two = (processor_seconds(study, folder / f"by_{count}", count) for count in (1, 2))
        same = all(len({(folder / f"by_{k}" / one).read_bytes() for k in (1, 2)}) == 1 for one in TABLES)
        dealt = rounds(folder / "by_1")
    work, shared = sum(map(sum, dealt)), sum(makespan(one, 2) for one in dealt)
    driver, more = alone - work, max(two - alone, 0.0)
    efficiency = alone / (2.0 * (shared + driver + 0.5 * more))
    tasks_done = sum(map(len, dealt))
    print(f"processor seconds: one process {alone:.1f}, two {two:.1f}; {tasks_done} tasks in {len(dealt)} rounds")
    print(f"of one process in tasks {work:.1f}, which two workers are through with in {shared:.1f}; else {driver:.1f}")
    print(f"efficiency of two processes {efficiency:.2f} (bar {BAR}); in tasks alone {work / (2.0 * shared):.2f}")
    print(f"the tables are {'the same to the bit' if same else 'NOT the same'}")
    return int(efficiency < BAR or not same)


if __name__ == "__main__":
    raise SystemExit(main())
