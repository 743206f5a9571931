"""What goes with a project that is closed, beside its unsaved changes: the render under way, and those made so far."""

from __future__ import annotations

from dataclasses import dataclass

from PySide6.QtWidgets import QWidget

from analysis.report.units import counted, percent
from studio.qt.calibrate.calibration_work import CalibrationWork
from studio.qt.calibrate.keeping import may_go as calibration_may_go
from studio.qt.core.jobs import RENDER, JobRunner, duration
from studio.qt.core.session import Session
from studio.qt.results.export_actions import LANE as EXPORT
from studio.qt.shell.panels import Panels
from studio.qt.study.keeping_study import may_go as study_may_go
from studio.qt.study.study_work import StudyWork

COSTLY = 60.0
"""s of work that a person waited for, and does not want to wait for again for a slip of the hand."""
STAY = "Keep with the project, in the menu of the list of renders, keeps one."


@dataclass(frozen=True)
class Going:
    """render: a sentence about what is under way that a person asked for, a render or an export; empty: nothing is."""

    render: str = ""
    renders: int = 0
    """Made by a person in this session and kept nowhere."""
    seconds: float = 0.0
    """That they took."""

    @property
    def told(self) -> str:
        """Of all; empty: nothing goes."""
        many = "" if self.renders == 1 else "s"
        go = "goes" if self.renders == 1 else "go"
        made = f"{self.renders} render{many} of this session {go} as well, whether saved or not. {STAY}"
        return "\n\n".join(filter(None, [self.render, made if self.renders else ""]))

    @property
    def costly(self) -> str:
        """Where no change is unsaved, what is asked about all the same; empty: nothing that took long goes."""
        one = self.renders == 1
        made = (
            f"{self.renders} render{'' if one else 's'} of this session, {duration(self.seconds)} of work, "
            f"{'is' if one else 'are'} kept nowhere. {STAY}"
        )
        return made if self.seconds >= COSTLY else ""


def what_goes(session: Session, runner: JobRunner, panels: Panels, *, quits: bool = False) -> Going:
    """A scan or study under way is not told of: what is measured stays in its folder, and the next run goes on.

    quits: the window closes, not the project alone.
    """
    job = runner.job(RENDER)
    asked = job is not None and job.name == "render" and panels["render"].asked and not job.cancel_asked  # type: ignore[attr-defined]
    done = percent(job.done, 0) if asked and job is not None else ""
    told = f"A render is under way, {done} of it done, and is lost." if done else ""
    if quits and (exports := [one.name.removeprefix("export ") for one in runner.jobs(EXPORT)]):
        told = f"{told} {', '.join(exports)} {'is' if len(exports) == 1 else 'are'} still being written.".strip()
    made = [one for one in session.renders if one.is_kept_nowhere]
    seconds = sum(sum(one.frame.seconds.values()) for one in made)
    return Going(told, len(made), seconds)


def others_may_go(session: Session, window: QWidget, *, quits: bool = False) -> bool:
    """Asks about what is saved in files of its own, once the project is dealt with: the study, and the calibration."""
    study, calibration = session.findChild(StudyWork), session.findChild(CalibrationWork)
    if study is not None and not study_may_go(study, window, quits=quits):
        return False
    return calibration is None or calibration_may_go(calibration, window, quits=quits)


def not_saved(session: Session) -> str:
    """For who saves the project: what of the session does not go into its file; empty: there is nothing."""
    renders, told = sum(one.is_kept_nowhere for one in session.renders), ""
    if renders:
        told = f"; {counted(renders, 'render')} of this session not kept with it: Keep, in Render"
    work = session.findChild(CalibrationWork)
    if work is not None and work.solved is not None and work.solved is not work.kept:
        told += "; the calibration is neither saved nor used in the project: see Calibrate"
    return told
