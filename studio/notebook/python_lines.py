"""What was done in the window, as lines of Python that give the same numbers: no Qt, and nothing is run here."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from pprint import pformat
from textwrap import indent
from typing import Any

from studio.project.project import Project
from studio.project.project_files import named_files
from studio.project.templates import DESCRIPTIONS, template_folder
from studio.scan.redevelop import development

WIDTH = 100
"""Columns of a line, where a value can be broken."""
ALONE = 60
"""Columns of a value that is worth a line beside what it stands in, in the measure of how much a project differs."""


@dataclass(frozen=True)
class Work:
    """What lies behind the figures that are shown."""

    project: Project
    """As it is now, at full scale; its `folder` is where its meshes are."""
    saved: Project | None = None
    """As `path` holds it; None: it was never saved."""
    path: Path | None = None
    rendered: Project | None = None
    """As it was when the render began, at full scale; None: nothing is rendered yet."""
    step: int = 0
    image_scale: float = 1.0
    final: bool = True
    """The render reached its errors."""
    methods: tuple[str, ...] = ()
    """That the line was found by; the first is the project's."""
    noise: bool = True
    report: Path | None = None
    """Where the report of these figures was written last."""


def python_lines(work: Work) -> str:
    """The script: load, what was changed since, render, develop, extract, triangulate, compare, report.

    Run by `exec` or pasted into a notebook it leaves `project`, `frame`, `image`, `line`, `points` and `errors` (of a
    rig with several lasers `images`, `lines`, a list of `points` and of `errors`), equal to those of the window.
    """
    rendered = work.project if work.rendered is None else work.rendered
    lines = ["import studio as blazer", "", *_loaded(work, rendered)]
    options = "".join(
        f", {name}={value!r}"
        for name, value, usual in (("step", work.step, 0), ("image_scale", work.image_scale, 1.0))
        if value != usual
    )
    if not work.final:
        lines.append("# the window's render was stopped before it reached its errors; this one goes on to them")
    lines.append(f"frame = blazer.render(project{options})")
    developed = ""
    now = development(rendered, work.project).powered
    if now != rendered:
        lines += ["", "# what was changed since needs no other render", *_changed("developed", rendered, now)]
        developed = ", project=developed"
    if not work.noise:
        developed += ", noise=False"
    count = len(rendered.scene.lasers)
    if count:
        lines += _measured(developed, count, work.methods[1:])
        if work.report is not None:
            image, line = ("image", "line") if count == 1 else ("images", "lines")
            lines.append(f"blazer.write_report({_literal(work.report)}, frame, {image}, {line}, points, errors)")
    return "\n".join(lines) + "\n"


def scan_lines(folder: Path, root: Path) -> str:
    """The script that runs a finished scan again: folder: what it was written into; root: where its meshes are."""
    again = folder.with_name(f"{folder.name} again")
    return "\n".join(
        [
            "from pathlib import Path",
            "",
            "import studio as blazer",
            "from studio.scan.scan import run_scan",
            "",
            "# the project as it was run, at the scale of its images",
            f"project = blazer.Project.load({_literal(folder / 'scan_project.json')}).in_folder({_literal(root)})",
            f"scan = run_scan(project, project.folder, out=Path({_literal(again)}))",
            'print(scan.manifest.get("results"))',
            "",
        ]
    )


def changes(before: Project, now: Project) -> list[tuple[str, Any]]:
    """What `Project.replaced` makes the one into the other with: path and plain value of each field that differs.

    What has another kind, or a list of another length, is one value as a whole.
    """
    return _differences(before.model_dump(mode="json"), now.model_dump(mode="json"), "")


def _differences(before: Any, now: Any, path: str) -> list[tuple[str, Any]]:
    if type(before) is type(now) and before == now:
        return []
    if isinstance(before, dict) and isinstance(now, dict) and before.keys() == now.keys():
        if before.get("kind") == now.get("kind"):
            names = ((name, f"{path}.{name}" if path else name) for name in now)
            return [found for name, place in names for found in _differences(before[name], now[name], place)]
    elif _holds_things(before) and _holds_things(now) and len(before) == len(now):
        pairs = enumerate(zip(before, now, strict=True))
        return [found for i, (a, b) in pairs for found in _differences(a, b, f"{path}[{i}]")]
    return [(path, now)]


def _holds_things(value: Any) -> bool:
    """A list of objects, lasers, lights: a vector is one value."""
    return isinstance(value, list) and all(isinstance(one, dict) for one in value)


def _loaded(work: Work, rendered: Project) -> list[str]:
    """`project`, from its file or, of one that has none, from the template that it differs least from."""
    if work.path is not None and work.saved is not None:
        path = work.path.absolute()
        name, base, folder = str(path), work.saved, path.parent
    else:
        templates = {name: Project.load(name) for name in DESCRIPTIONS}
        name = min(templates, key=lambda name: _size(changes(templates[name], rendered)))
        base, folder = templates[name], template_folder(name)
    lines = [f"project = blazer.Project.load({_literal(name)})", *_changed("project", base, rendered)]
    if work.project.folder.absolute() != folder.absolute() and named_files(rendered.scene, "scene"):
        lines.append(f"project = project.in_folder({_literal(work.project.folder.absolute())})")
    return lines


def _size(found: list[tuple[str, Any]]) -> float:
    return sum(1.0 + len(json.dumps(value)) / ALONE for _, value in found)


def _changed(name: str, before: Project, now: Project) -> list[str]:
    found = changes(before, now)
    if len(found) == 1 and len(repr(found)) < WIDTH - 40:
        path, value = found[0]
        return [f'{name} = project.replaced({{"{path}": {_literal(value)}}})']
    entries = [indent(f'"{path}": {_literal(value)},', " " * 8) for path, value in found]
    return [f"{name} = project.replaced(", "    {", *entries, "    }", ")"] if found else []


def _literal(value: Any) -> str:
    """Python for plain data; text in double quotes where it can be."""
    if isinstance(value, str | Path):
        text = str(value)
        return f'"{text}"' if repr(text) == f"'{text}'" and '"' not in text else repr(text)
    return pformat(value, width=WIDTH, sort_dicts=False, compact=True)


def _measured(developed: str, count: int, others: tuple[str, ...]) -> list[str]:
    """The line by the project's method, and the errors by each of the other methods."""
    if count == 1:
        lines = [
            f"image = blazer.develop(frame{developed})",
            "line = blazer.extract(image)",
            "points = blazer.triangulate(line)",
            "errors = blazer.compare(points, frame)",
            "print(errors)",
        ]
        chain = 'blazer.compare(blazer.triangulate(blazer.extract(image, method="{0}")), frame)'
    else:
        lines = [
            f"images = [blazer.develop(frame, laser=i{developed}) for i in range({count})]",
            "lines = [blazer.extract(image) for image in images]",
            "points = [blazer.triangulate(line) for line in lines]",
            "errors = [blazer.compare(one, frame) for one in points]",
            "print(*errors, sep='\\n')",
        ]
        chain = '[blazer.compare(blazer.triangulate(blazer.extract(image, method="{0}")), frame) for image in images]'
    for method in others:
        lines += [f"errors_{method} = {chain.format(method)}", f"print(errors_{method})"]
    return lines
