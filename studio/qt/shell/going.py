"""What goes with a project that is closed, beside its unsaved changes: the render under way, and those made so far."""

from __future__ import annotations

from dataclasses import dataclass

from analysis.report.units import percent
from studio.qt.core.jobs import RENDER, JobRunner
from studio.qt.core.session import Session
from studio.qt.shell.panels import Panels

STAY = "Keep with the project, in the menu of the list of renders, keeps one."


@dataclass(frozen=True)
class Going:
    """render: a sentence about the one under way that a person asked for; empty: there is none."""

    render: str = ""
    renders: int = 0
    """Made by a person in this session and kept nowhere."""

    @property
    def told(self) -> str:
        """Of both; empty: nothing goes."""
        many = "" if self.renders == 1 else "s"
        go = "goes" if self.renders == 1 else "go"
        made = f"{self.renders} render{many} of this session {go} as well, whether saved or not. {STAY}"
        return "\n\n".join(filter(None, [self.render, made if self.renders else ""]))


def what_goes(session: Session, runner: JobRunner, panels: Panels) -> Going:
    """A scan or study under way is not told of: what is measured stays in its folder, and the next run goes on."""
    job = runner.job(RENDER)
    asked = job is not None and job.name == "render" and panels["render"].asked and not job.cancel_asked  # type: ignore[attr-defined]
    done = percent(job.done, 0) if asked and job is not None else ""
    told = f"A render is under way, {done} of it done, and is lost." if done else ""
    made = [one for one in session.renders if one.asked and not (one.kept or one.scan or one.cell or one.refining)]
    return Going(told, len(made))
