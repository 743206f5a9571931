"""What stands above all figures of a render: why they are not the scanner's, or not of the scene as it is now."""

from __future__ import annotations

from studio.qt.core.figures_age import FiguresAge
from studio.qt.core.render import Render
from studio.qt.core.scan_steps import scan_steps
from studio.qt.core.session import Session, one_of
from studio.scan.redevelop import is_developed_otherwise
from studio.scan.remarks import scale_head

STOPPED = "This render was stopped early: light is missing, and the figures are of what there is."
AWAITED = "The render goes on: figures come with ambient light, without whose noise they would be too good."
REFINING = "The render goes on: light is still to come, and these are the figures so far."
MEASURING = "Measuring… until then these are the figures of the settings before."
UNMEASURED = "This step's points are still to come: the steps of a scan are read and measured as they are looked at."
GROWING = (
    "The points in the 3D view are of the scan that was started last; these are the figures of what is shown here."
)
CHANGED = "The scene has changed since: these are the figures of the render as it was."
MEASURED_OTHERWISE = (
    "Measure > Measure the scan again: figures of all steps are as they were measured, and laser power, sensor, "
    "extraction or calibration has changed since."
)
"""The remedy first."""


def heads(session: Session, step_problem: str, growing: bool = False) -> list[str]:
    """Nothing where they are what they seem. step_problem: why the step that is looked at cannot be shown; growing: the
    points in the 3D view are of another scan."""
    render = session.shown
    told = [f"Step {session.step + 1} cannot be shown: {step_problem}"] if step_problem else []
    if render is None:
        return told
    if growing:
        told.append(GROWING)
    if one_of(FiguresAge, session).old:
        told.append(MEASURING)
    if render.cell:
        told.append(f"Cell of a study: {render.name}. Your own renders are in the list of the Render workspace.")
    elif session.stale and (render.scan is None or render.frame.step == session.step):
        told.append(CHANGED)
    if not render.measurements and render.scan is not None and render.scan.measured:
        told.append(UNMEASURED)
    if measured_otherwise(session, render):
        told.append(MEASURED_OTHERWISE)
    if not render.final:
        so_far = REFINING if render.measurements else AWAITED
        told.append(so_far if render.refining else STOPPED)
    return [*told, *filter(None, [scale_head(render.scanner_scale)])]


def measured_otherwise(session: Session, render: Render) -> bool:
    """A scan, whose points would be others with the sensor, extraction, powers or calibration of now."""
    if render.scan is None or not render.scan.measured:
        return False
    before = scan_steps(session).measured_as(render)
    return is_developed_otherwise(before, session.project, render.image_scale)
