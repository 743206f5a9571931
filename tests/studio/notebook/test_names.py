"""The names of `import studio`: they cost nothing until they are used, and are all there."""

from __future__ import annotations

import ast
import importlib
import subprocess
import sys
from pathlib import Path

import pytest

import studio as blazer

ROOT = Path(__file__).resolve().parents[3]
NAMES = ast.parse((ROOT / "studio" / "__init__.py").read_text(encoding="utf-8"))


class TestNames:
    def test_the_package_alone_loads_no_library(self) -> None:
        code = "import sys, studio; print(*sorted(name.split('.')[0] for name in sys.modules))"
        done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
        loaded = set(done.stdout.split())
        assert "studio" in loaded
        assert loaded & {"numpy", "numba", "pydantic", "matplotlib", "render", "analysis", "PySide6"} == set()

    def test_every_name_is_there_and_known_to_type_checkers_alike(self) -> None:
        block = next(node for node in NAMES.body if isinstance(node, ast.If))
        typed = {
            alias.asname: f"{node.module}.{alias.name}"
            for node in block.body
            if isinstance(node, ast.ImportFrom)
            for alias in node.names
        }
        assert set(typed) == set(blazer.__all__) <= set(dir(blazer))
        for name, place in typed.items():
            assert getattr(blazer, name) is getattr(importlib.import_module(place.rpartition(".")[0]), name)

    def test_an_unknown_name_is_an_attribute_error_and_rooms_are_still_rooms(self) -> None:
        with pytest.raises(AttributeError, match="no attribute 'rendr'"):
            blazer.rendr  # noqa: B018
        assert importlib.import_module("studio.scan").__name__ == "studio.scan"

    def test_no_name_hides_a_room(self) -> None:
        rooms = {path.name for path in (ROOT / "studio").iterdir() if path.is_dir()}
        assert rooms & set(blazer.__all__) == set()
