"""One HTML page that holds all it shows: the layout and the style that every report has in common."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from analysis.report.style import plain


def page_of(template: Path, content: dict[str, Any]) -> str:
    """The page of a template that extends `layout.html`, with the reports' style."""
    import jinja2
    from markupsafe import Markup

    here = Path(__file__).parent
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader([template.parent, here]),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        finalize=_printable,
    )
    style = (here / "style.css").read_text(encoding="utf-8")
    return environment.get_template(template.name).render(style=Markup(style), **content)


def _printable(value: Any) -> Any:
    """Names come from files: what the template prints is text only. Markup and pictures are ours."""
    from markupsafe import Markup

    ours = isinstance(value, Markup) or not isinstance(value, str) or value.startswith("data:image/png;base64,")
    return value if ours else plain(value)
