"""What the READMEs of the rooms name exists: a file that was moved or a function that was renamed is found here."""

from __future__ import annotations

import ast
import builtins
import keyword
import re
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
ROOMS = ("render", "analysis", "studio")
TEXTS = [ROOT / "CONTRIBUTING.md", *sorted(path for room in ROOMS for path in (ROOT / room).rglob("README.md"))]
CODE = re.compile(r"`([^`\n]+)`")
NAME = re.compile(r"[A-Za-z_]\w*(\.[A-Za-z_]\w*)*")
FILE = re.compile(r"[\w./-]+\.(?:py|md|json|html|toml)")
FOLDER = re.compile(r"[a-z][\w.-]*(?:/[\w.-]+)+/?")
SOMEONE_ELSES = {"analysis.py"}
"""Files that a user may have beside a notebook."""
PLACEHOLDER = re.compile(r"(?<![A-Za-z_])(?:NAME|KEY|vN)(?![A-Za-z_])")


@cache
def names() -> frozenset[str]:
    """Whatever the sources and tests define: modules, functions, classes, arguments, fields, constants, and strings."""
    found = {*ROOMS, "tests", "main", *keyword.kwlist, *dir(builtins)}
    found |= set(re.findall(r"\w+", (ROOT / "pyproject.toml").read_text(encoding="utf-8")))
    for room in (*ROOMS, "tests"):
        for path in (ROOT / room).rglob("*.py"):
            found |= {path.stem, path.parent.name}
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                match node:
                    case ast.FunctionDef(name=name) | ast.ClassDef(name=name) | ast.arg(arg=name):
                        found.add(name)
                    case ast.Name(id=name, ctx=ast.Store()) | ast.Attribute(attr=name) | ast.alias(name=name):
                        found.add(name)
                    case ast.keyword(arg=str(name)) | ast.Constant(value=str(name)):
                        found.add(name)
    return frozenset(found)


@cache
def files() -> tuple[str, ...]:
    """Every file of the project, from its root."""
    folders = (*ROOMS, "tests", "assets", ".ci")
    inside = (path for folder in folders for path in (ROOT / folder).rglob("*") if path.is_file())
    return tuple(f"/{path.relative_to(ROOT).as_posix()}" for path in (*inside, *ROOT.glob("*.*")))


def is_there(token: str, room: Path) -> bool:
    """Files and folders are named from the room, from `render` or from the root, or a file by its name alone."""
    if FILE.fullmatch(token):
        return token in SOMEONE_ELSES or (room / token).is_file() or any(path.endswith(f"/{token}") for path in files())
    if FOLDER.fullmatch(token):
        module, _, name = token.rpartition(".")
        places = (room, room.parent, ROOT, ROOT / "render")
        member = any((place / f"{module}.py").is_file() for place in places) and name in names()
        return member or any((place / token).exists() for place in places)
    return not NAME.fullmatch(token) or token.rpartition(".")[2] in names()


@pytest.mark.parametrize("text", TEXTS, ids=lambda path: str(path.relative_to(ROOT)))
def test_all_that_a_readme_names_exists(text: Path):
    tokens = CODE.findall(text.read_text(encoding="utf-8"))
    assert not [token for token in tokens if not PLACEHOLDER.search(token) and not is_there(token, text.parent)]
