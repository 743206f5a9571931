"""What a fresh clone relies on: pinned versions, no addresses, the layout of the house, one test command."""

from __future__ import annotations

import ast
import json
import re
import subprocess
import sys
import tomllib
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

import main
from studio.project.project import Project

ROOT = Path(__file__).resolve().parents[1]
TOP_LEVEL = {
    *("studio", "render", "analysis", "assets", "tests", "main.py", "pyproject.toml", "README.md", "LICENSE"),
    *("CONTRIBUTING.md", "CHANGELOG.md", "Makefile", ".gitignore", ".ci"),
}
PYPROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
CONSTRAINTS = (ROOT / ".ci" / "constraints.txt").read_text(encoding="utf-8").splitlines()
FEWEST_TESTS = 1950
"""Test functions, each of which may stand for many cases."""
MOST_LINES = 400


def tracked() -> list[Path]:
    done = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True)
    if done.returncode != 0:
        pytest.skip("not a git checkout")
    return [Path(name) for name in done.stdout.split("\0") if name]


def pinned() -> dict[str, str]:
    return {canonicalize_name(line.split("==")[0]): line.split("==")[1] for line in CONSTRAINTS}


def needed(requirements: list[str]) -> set[str]:
    """Names of these requirements and of all that they need, as installed here."""
    found: set[str] = set()
    waiting = [Requirement(text) for text in requirements]
    while waiting:
        requirement = waiting.pop()
        name = canonicalize_name(requirement.name)
        extras = requirement.extras or {""}
        if requirement.marker and not any(requirement.marker.evaluate({"extra": extra}) for extra in extras):
            continue
        if name in found:
            continue
        found.add(name)
        try:
            below = distribution(name).requires or []
        except PackageNotFoundError:
            continue
        for text in below:
            child = Requirement(text)
            if child.marker is None or any(child.marker.evaluate({"extra": extra}) for extra in extras):
                child.marker = None
                waiting.append(child)
    return found


def test_constraints_are_names_and_versions_only() -> None:
    assert [line for line in CONSTRAINTS if not re.fullmatch(r"[A-Za-z0-9._-]+==[A-Za-z0-9.!+]+", line)] == []


def test_every_package_is_pinned_with_all_that_it_needs() -> None:
    project = PYPROJECT["project"]
    extras = project["optional-dependencies"]
    everything = needed([*project["dependencies"], *extras["test"], *extras["validation"]])
    assert everything - pinned().keys() == set()


def test_the_build_tool_is_pinned_to_the_same_version() -> None:
    assert PYPROJECT["build-system"]["requires"] == [f"setuptools=={pinned()['setuptools']}"]


def test_pins_satisfy_the_declared_ranges() -> None:
    project = PYPROJECT["project"]
    extras = [text for texts in project["optional-dependencies"].values() for text in texts]
    for text in [*project["dependencies"], *extras]:
        requirement = Requirement(text)
        assert pinned()[canonicalize_name(requirement.name)] in requirement.specifier, text


def test_no_set_up_file_writes_an_index_address() -> None:
    for name in ("Makefile", "pyproject.toml", ".ci/run", ".ci/constraints.txt", "studio/runtime/system.py"):
        text = (ROOT / name).read_text(encoding="utf-8")
        assert not re.search(r"https?://|index-url|find-links|trusted-host", text), name


def test_the_top_level_is_the_house_and_nothing_else() -> None:
    assert {path.parts[0] for path in tracked()} <= TOP_LEVEL


def test_the_version_is_the_same_everywhere() -> None:
    version = PYPROJECT["project"]["version"]
    assert version == main.VERSION
    assert f"## {version}" in (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")


def test_ci_runs_the_test_command_of_the_readme() -> None:
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    assert "\nmake test\n" in readme
    assert "make test" in (ROOT / ".ci" / "run").read_text(encoding="utf-8")


def test_the_entry_imports_nothing_but_click_at_its_top() -> None:
    ours = {f"studio.runtime.{name}" for name in ("command_line", "command_options", "streams", "system")}
    ours.add("studio.commands.of_scans")
    for file in ("main.py", *(name.replace(".", "/") + ".py" for name in ours)):
        tree = ast.parse((ROOT / file).read_text(encoding="utf-8"))
        statements = [*tree.body, *(inner for node in tree.body if isinstance(node, ast.Try) for inner in node.body)]
        modules = {alias.name for node in statements if isinstance(node, ast.Import) for alias in node.names}
        modules |= {node.module or "" for node in statements if isinstance(node, ast.ImportFrom)}
        standard = {name for name in modules if name.split(".")[0] in sys.stdlib_module_names}
        assert modules - standard <= {"click", *ours}


def test_only_the_desktop_knows_qt_and_only_one_file_embree() -> None:
    for path in [
        *ROOT.glob("main.py"),
        *ROOT.glob("render/**/*.py"),
        *ROOT.glob("analysis/**/*.py"),
        *ROOT.glob("studio/**/*.py"),
    ]:
        text = path.read_text(encoding="utf-8")
        relative = path.relative_to(ROOT).as_posix()
        assert relative == "render/world/embree.py" or not re.search(r"^\s*(import|from) embreex", text, re.M), relative
        if not relative.startswith("studio/qt/"):
            assert not re.search(r"^\s*(import|from) (PySide6|PyQt\d|pyvistaqt|qtpy)", text, re.M), relative


def test_files_stay_small() -> None:
    long = {}
    for path in tracked():
        if path.suffix == ".py":
            lines = len((ROOT / path).read_text(encoding="utf-8").splitlines())
            if lines > MOST_LINES:
                long[str(path)] = lines
    assert long == {}


def test_no_test_is_lost_unseen() -> None:
    """A file that another overwrites takes its tests along; raise the number with the tests, lower it with a reason."""
    trees = [
        ast.parse((ROOT / path).read_text(encoding="utf-8"))
        for path in tracked()
        if path.parts[0] == "tests" and path.suffix == ".py"
    ]
    found = sum(
        isinstance(node, ast.FunctionDef) and node.name.startswith("test_") for tree in trees for node in ast.walk(tree)
    )
    assert found >= FEWEST_TESTS


def test_the_project_in_the_readme_is_a_project() -> None:
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    blocks = re.findall(r"```json\n(.*?)```", readme, re.DOTALL)
    whole, measures = blocks
    assert Project.from_text(whole).scene.frame_count == 5
    measured = Project.from_data(json.loads(whole) | json.loads(f"{{{measures}}}"))
    assert [one.kind for one in measured.measures] == ["step"]


def test_every_command_in_the_readme_exists() -> None:
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    used = set(re.findall(r"^python main\.py (\w+)", readme, re.MULTILINE))
    assert used == set(main.cli.commands)
    targets = set(re.findall(r"^make (\w+)", readme + (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8"), re.M))
    assert targets <= set(re.findall(r"^(\w+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE))
