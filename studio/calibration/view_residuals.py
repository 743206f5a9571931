"""View by view beside a calibration: used or not and why, how far off its corners are, and where they should be."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

import numpy as np

from analysis.calibration.adjust import adjust
from analysis.calibration.circles import centre_bias
from analysis.calibration.observations import View, gather
from analysis.calibration.residuals import corners, laser_points
from analysis.calibration.start import start
from render.base.arrays import Bool, Float
from render.base.errors import InputError

if TYPE_CHECKING:
    from analysis.calibration.calibrate import Calibrated

Part = Literal["used", "left out", "dropped"]


@dataclass(frozen=True)
class Residuals:
    """Of one view: n corners and m laser points, each found at `pixel`, which the calibration sees at pixel + off."""

    name: str
    pixel: Float
    """(n, 2) px."""
    off: Float
    """(n, 2) px."""
    counted: Bool
    """(n,) False: left out as a stray."""
    laser_pixel: Float
    """(m, 2) px."""
    laser_off: Float
    """(m, 2) px, along the scan line."""
    part: Part
    rotation: Float
    """(3, 3) board to camera."""
    translation: Float
    """(3,) m."""

    @property
    def rms(self) -> float:
        """px, of the corners that count."""
        return float(np.sqrt(np.mean(np.sum(self.off[self.counted] ** 2, axis=1))))


def residuals(view: View, result: Calibrated, target: Float, *, dropped: bool = False) -> Residuals:
    """Of a view that the calibration was made with, or of another: its pose alone is fitted then.

    target (n, 2) m, all corners of the board. InputError: the pose cannot be found.
    """
    estimate, kept = result.estimate, result.adjusted.seen
    planes = len(estimate.planes)
    view = replace(view, stripes=tuple(stripe for stripe in view.stripes if stripe.laser < planes))
    seen = gather([view], np.stack([target.min(axis=0), target.max(axis=0)]))
    counted = np.ones(len(view.pixel), dtype=bool)
    if view.name in kept.names and not dropped:
        part: Part = "used"
        number = kept.names.index(view.name)
        # a board that is carried may have been counted from its other end
        seen = replace(seen, target=kept.target[kept.view == number])
        posed = estimate.with_poses(estimate.rotation[number : number + 1], estimate.translation[number : number + 1])
        counted = kept.whitening[kept.view == number][:, 0, 0] > 0.0
    else:
        part = "dropped" if dropped else "left out"
        corners_only = gather([replace(view, stripes=())], np.stack([target.min(axis=0), target.max(axis=0)]))
        camera = (estimate.intrinsics, estimate.distortion)
        guess = start([view], (0, 0), len(estimate.distortion), 0, known=camera)
        held = estimate.with_poses(guess.rotation, guess.translation)
        posed = adjust(corners_only, held, np.zeros(len(held.shared), dtype=bool)).estimate
    plain = replace(
        seen,
        whitening=np.broadcast_to(np.eye(2), seen.whitening.shape),
        laser_weight=np.ones_like(seen.laser_weight),
    )
    along, _ = laser_points(plain, posed)
    line = np.zeros((len(along.residual), 2))
    line[np.arange(len(line)), seen.along] = along.residual
    off = corners(plain, posed).residual.reshape(-1, 2)
    if result.circle > 0.0:
        off = off + centre_bias(posed, seen.view, seen.target, result.circle)
    return Residuals(
        view.name, view.pixel, off, counted, seen.laser_pixel, line, part, posed.rotation[0], posed.translation[0]
    )


@dataclass(frozen=True)
class ViewRow:
    """A line of the list of views; rms in px, None before there is a calibration, or where no pose fits."""

    name: str
    part: Part
    corners: int
    lines: int
    rms: float | None
    remarks: tuple[str, ...]


def view_rows(
    views: Sequence[View], dropped: Collection[str], notes: Sequence[str], result: Calibrated | None, target: Float
) -> list[tuple[ViewRow, Residuals | None]]:
    """Every view in the order given; notes: sentences that begin with a view's name and a colon."""
    out = []
    told = [*notes, *(() if result is None else result.adjusted.left_out)]
    for view in views:
        found = None
        if result is not None:
            try:
                found = residuals(view, result, target, dropped=view.name in dropped)
            except (InputError, np.linalg.LinAlgError):
                found = None
        part: Part = "dropped" if view.name in dropped else "used" if found is None else found.part
        remarks = tuple(text.removeprefix(f"{view.name}: ") for text in told if text.startswith(f"{view.name}: "))
        rms = None if found is None else found.rms
        out.append((ViewRow(view.name, part, len(view.pixel), len(view.stripes), rms, remarks), found))
    return out
