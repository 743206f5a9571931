"""Programs killed at random moments, and what they leave: `python tests/validation/kills.py 500`.

Kills are spread over `run`, `run --resume`, `render`, `reconstruct`, saving and, one in fifty, the first compilation of
the kernels. Each folder left must be whole, go on to the same bytes as without a kill, or be refused with the reason.
Ends with exit code 1 and the folders kept where one is not.
"""

from __future__ import annotations

import argparse
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

import main  # noqa: E402
from render.base.errors import InputError  # noqa: E402
from studio.project.document import replaced  # noqa: E402
from studio.project.project import Project  # noqa: E402
from studio.scan import scan_folder  # noqa: E402
from tests.studio.small_scan import SCALE, contents, scan, small_project  # noqa: E402

POWERS = {"weak": 0.001, "strong": 0.01}
OPTIONS = ("--scale", str(SCALE), "--threads", "1", "--quiet")
COMPILE_SECONDS = 60.0
"""Kills of the first compilation come within so long."""


class WrongError(Exception):
    """A kill left what it must not."""


def forked(work: Callable[[], int]) -> int:
    """A child that does it and ends with its result; the process id. Loaded kernels are shared with it."""
    child = os.fork()
    if child:
        return child
    code = 3
    try:
        os.setpgid(0, 0)  # with what it starts itself
        code = work()
    finally:
        os._exit(code)


def command(log: Path, *words: object) -> Callable[[], int]:
    """A command line, its output in a file."""

    def work() -> int:
        with open(log, "wb") as file:
            for descriptor in (1, 2):
                os.dup2(file.fileno(), descriptor)
        sys.argv = ["main.py", *map(str, words)]
        try:
            main.cli.main(list(map(str, words)), standalone_mode=True)
        except SystemExit as end:
            sys.stdout.flush()
            return int(end.code or 0)
        return 0

    return work


def finish(work: Callable[[], int]) -> int:
    """Its exit code."""
    return os.waitstatus_to_exitcode(os.waitpid(forked(work), 0)[1])


def kill(work: Callable[[], int], seconds: float) -> bool:
    """Kill it after so long; False: it ended before."""
    child = forked(work)
    ends = time.monotonic() + seconds
    while time.monotonic() < ends:
        if os.waitpid(child, os.WNOHANG)[0]:
            return False
        time.sleep(0.0005)
    for end in (os.killpg, os.kill):  # its group, which it may not have made yet
        try:
            end(child, signal.SIGKILL)
        except ProcessLookupError:
            continue
    os.waitpid(child, 0)
    return True


def kind_of(words: tuple[object, ...]) -> str:
    """Commands that take about as long."""
    return f"{words[0]} {'--no-report' in words} {'--resume' in words}"


class Kills:
    """The folders, and the scans that no kill met."""

    def __init__(self, folder: Path, chance: random.Random) -> None:
        self.folder, self.chance, self.out, self.log = folder, chance, folder / "out", folder / "log.txt"
        self.files: dict[str, Path] = {}
        self.wholes: dict[tuple[str, str], dict[str, bytes]] = {}
        self.seconds: dict[str, float] = {}
        for name, power in POWERS.items():
            file = small_project(folder / name)
            replaced(Project.load(file), ("scene", "rig", "lasers", 0, "power"), power).save(file)
            self.files[name] = file
        gaussian = replaced(Project.load(self.files["weak"]), ("extraction", "method"), "gaussian")
        for kind in ("run", "render"):
            for name, file in self.files.items():
                self.end(kind, file, "--out", folder / f"{kind} {name}", *OPTIONS)
                self.wholes[kind, name] = contents(folder / f"{kind} {name}")
        ran = scan_folder.open_folder(folder / "run weak").project
        self.gaussian = folder / "weak" / "gaussian.json"
        ran.model_copy(update={"extraction": gaussian.extraction}).save(self.gaussian)
        self.begin_with("run weak")
        self.end("reconstruct", self.out, "--project", self.gaussian, "--threads", "1", "--quiet")
        self.wholes["reconstruct", "weak"] = contents(self.out)

    def end(self, *words: object) -> None:
        """Let a command end, and note how long it takes as busy as the machine is now. WrongError: not with exit 0."""
        began = time.monotonic()
        code = finish(command(self.log, *words))
        if code != 0:
            raise WrongError(f"{' '.join(map(str, words))}: exit {code}\n{self.log.read_text()}")
        self.seconds[kind_of(words)] = time.monotonic() - began

    def kill(self, *words: object) -> bool:
        """At a random moment; False: it ended before."""
        kind = kind_of(words)
        began = time.monotonic()
        met = kill(command(self.log, *words), self.chance.uniform(0.0, 1.1) * self.seconds.get(kind, 1.0))
        if not met:
            self.seconds[kind] = time.monotonic() - began
        return met

    def same(self, kind: str, name: str, *, ended: bool = True) -> None:
        """WrongError: other bytes, or, where a program ended of itself, hidden files."""
        found, whole = contents(self.out), self.wholes[kind, name]
        if found != whole:
            differ = sorted(file for file in found.keys() | whole.keys() if found.get(file) != whole.get(file))
            raise WrongError(f"{kind} of {name}: other bytes in {', '.join(differ)}")
        hidden = [path.name for path in self.out.iterdir() if path.name.startswith(".")]
        if ended and hidden:
            raise WrongError(f"left behind: {', '.join(hidden)}")

    def begin_with(self, before: str) -> None:
        shutil.rmtree(self.out, ignore_errors=True)
        if before != "nothing":
            shutil.copytree(self.folder / before, self.out)

    def scanning(self, kind: str) -> str:
        """Kill a scan over an earlier one, and perhaps again as it goes on."""
        before = self.chance.choice(["nothing", "run weak", "render weak", "run strong"])
        name = self.chance.choice(list(POWERS))
        self.begin_with(before)
        without = ("--no-report",) if kind == "run" and self.chance.random() < 0.8 else ()  # which takes longest
        words = (kind, self.files[name], "--out", self.out, *OPTIONS, *without)
        met = self.kill(*words)
        while met and self.chance.random() < 0.3:
            met = self.kill(*words, "--resume")
        state = self.state()
        if finish(command(self.log, *words, "--resume")) != 0:
            self.check_reason()
            state += ", refused to go on with it"
            self.end(*words)
        self.same(kind, name)
        return state

    def reconstruct(self) -> str:
        """Kill a measurement of a finished scan."""
        self.begin_with("run weak")
        words = ("reconstruct", self.out, "--project", self.gaussian, "--threads", "1", "--quiet")
        self.kill(*words)
        found = scan_folder.open_folder(self.out)
        results = found.manifest.get("results")
        if results is not None:
            self.same("run" if results[0]["method"] == "likelihood" else "reconstruct", "weak", ended=False)
        self.end(*words)
        self.same("reconstruct", "weak")
        return "whole" if results is not None else "frames whole, not measured"

    def save(self) -> str:
        """Kill a program that saves two versions in turn."""
        file = self.folder / "save" / "part.json"
        versions = [Project.load(path) for path in self.files.values()]
        texts = [replaced(one, ("name",), "part").to_text() for one in versions]
        if not file.exists():
            file.parent.mkdir()
            file.write_text(texts[0])

        def work() -> int:
            while True:
                for text in texts:
                    Project.from_text(text).save(file)

        kill(work, self.chance.uniform(0.0, 0.1))
        if Project.load(file).with_digests(self.folder / "weak").to_text() not in texts:
            raise WrongError(f"{file} is neither version")
        return "whole"

    def state(self) -> str:
        """What the folder says of itself. WrongError: it calls whole what is not."""
        if not self.out.exists():
            return "nothing yet"
        try:
            scan_folder.open_folder(self.out)
        except InputError as error:
            if "did not finish" not in str(error):
                raise WrongError(str(error)) from None
            return "unfinished"
        if contents(self.out) not in self.wholes.values():
            raise WrongError("a finished scan of other bytes")
        return "whole"

    def check_reason(self) -> None:
        told = self.log.read_text()
        if "Traceback" in told or told.count("error: ") != 1 or "internal error" in told:
            raise WrongError(f"refused without a reason:\n{told}")


def compilation(folder: Path, kills: Kills, count: int) -> None:
    """Kill the first compilation of a copy of the program so often, then let it end."""
    tree, out = folder / "tree", folder / "tree out"
    for name in ("analysis", "assets", "render", "studio"):
        shutil.copytree(ROOT / name, tree / name, ignore=shutil.ignore_patterns("__pycache__"))
    for name in ("main.py", "pyproject.toml"):
        shutil.copy(ROOT / name, tree)
    environment = {name: value for name, value in os.environ.items() if name != "NUMBA_CACHE_DIR"}
    words = [sys.executable, "main.py", "run", str(kills.files["weak"]), "--out", str(out), *OPTIONS]
    for n in range(count + 1):
        pipes = {"stdout": subprocess.DEVNULL, "stderr": subprocess.PIPE}
        child = subprocess.Popen(words, cwd=tree, env=environment, start_new_session=True, **pipes)
        try:
            _, told = child.communicate(timeout=None if n == count else kills.chance.uniform(1.0, COMPILE_SECONDS))
        except subprocess.TimeoutExpired:
            os.killpg(child.pid, signal.SIGKILL)
            child.communicate()
            continue
        if child.returncode != 0:
            raise WrongError(
                f"after {n} kills of the compilation: exit {child.returncode}\n{told.decode(errors='replace')}"
            )
    found, whole = contents(out), kills.wholes["run", "weak"]
    if found != whole:
        raise WrongError("kernels whose compilation was killed give other bytes")


def judged(count: int, seed: int) -> int:
    folder = Path(tempfile.mkdtemp(prefix="kills-"))
    seen: Counter[str] = Counter()
    try:
        # loads all that the children need, which share it
        scan(small_project(folder / "warm"), folder / "warm out", report=True)
        kills = Kills(folder, random.Random(seed))
        compile_kills = count // 50
        kinds: list[Callable[[], str]] = [
            lambda: kills.scanning("run"),
            lambda: kills.scanning("render"),
            kills.reconstruct,
            lambda: kills.scanning("run"),
            kills.save,
        ]
        names = ["run", "render", "reconstruct", "run", "save"]
        for n in range(count - compile_kills):
            k = n % len(kinds)
            seen[f"{names[k]}: {kinds[k]()}"] += 1
            if n % 50 == 49:
                print(f"{n + 1} kills", flush=True)
        if compile_kills:
            compilation(folder, kills, compile_kills)
            seen["first compilation: the same bytes in the end"] += compile_kills
    except WrongError as wrong:
        print(f"after {sum(seen.values())} kills, in {folder}: {wrong}")
        return 1
    shutil.rmtree(folder)
    for what, number in sorted(seen.items()):
        print(f"{number:5}  {what}")
    return 0


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("count", type=int, nargs="?", default=100, help="kills")
    parser.add_argument("--seed", type=int, default=1)
    chosen = parser.parse_args()
    sys.exit(judged(chosen.count, chosen.seed))
