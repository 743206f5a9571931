"""What a render will compute and what it has reached, as rich text."""

from __future__ import annotations

from html import escape

from analysis.report.light_text import foretold_lines, plan_lines, quality_lines
from render.plan import Plan
from studio.qt.core.render import Render

LONGEST_HEAD = 20
"""Letters before a colon that stand out."""


def plan_text(plan: Plan) -> str:
    """Rich text: what a line is about stands out."""
    shown = []
    for line in plan_lines(plan):
        head, colon, rest = line.partition(":")
        bold = f"<b>{escape(head)}</b>" if len(head) <= LONGEST_HEAD else escape(head)
        shown.append(f"<p style='margin: 3px 0'>{bold}{colon}{escape(rest)}</p>")
    return "".join(shown)


def error_text(render: Render) -> str:
    """Error so far of every light group, and what it is to become."""
    known = [f"{escape(name)}: {escape(text)}" for name, text in quality_lines(render.frame.quality)]
    return "<br>".join([*known, *map(escape, foretold_lines(render.frame.foretold))])
