"""The exposure that the line fills, and by what: the shown render, or the live estimate where that will not do."""

from __future__ import annotations

from typing import NamedTuple

from studio.editing.units import Unit
from studio.preview.readouts import readouts
from studio.preview.remedy_changes import FILLED, automatic_exposure
from studio.project.project import Project
from studio.qt.core.live_preview import live
from studio.qt.core.render import Render
from studio.qt.core.session import Session
from studio.qt.render.render_row import title
from studio.scan.exposure import filling_exposure
from studio.scan.redevelop import development


class Exposure(NamedTuple):
    """A time, s, and by what it was chosen."""

    time: float
    by: str

    @property
    def told(self) -> str:
        """A sentence."""
        aim = f"the line's peaks, without noise and glints, are aimed at {FILLED:.0%} of full scale"
        return f"Exposure {Unit.of('s').with_unit(self.time)}: {aim}, {self.by}; single pixels may be brighter"


def filling(session: Session) -> Exposure | None:
    """By the shown render where it is whole and of the scene as it is; None: no line is to be seen.

    InputError: it would be beyond what an exposure may be.
    """
    project, render = session.project, session.shown
    why_not = "nothing is rendered" if render is None else _why_not(render, project)
    if render is not None and not why_not:
        how = development(render.project, project)
        time = filling_exposure(how.project, render.frame, how.laser_power, FILLED)
        return None if time is None else Exposure(time, f"by {title(render)}")
    live(session).refresh()
    look = live(session).look
    found = [automatic_exposure(project, readouts(look, i)) for i in range(len(look.scene.lasers))]
    times = [one[1].sensor.exposure_time for one in found if one is not None]
    return Exposure(min(times), f"as estimated for the present scene, as {why_not}") if times else None


def _why_not(render: Render, project: Project) -> str:
    """Why a render cannot be gone by; empty: it can."""
    if render.cell:
        return f"{title(render)} is a cell of a study"
    if render.is_stale(project):
        return f"{title(render)} is of another scene"
    if not render.final:
        return f"{title(render)} is not finished"
    if render.scanner_scale != 1.0:
        return f"{title(render)} is at {render.scanner_scale:.3g} of the scanner's image"
    return ""
