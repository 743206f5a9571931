"""A text beside a place of a plot that stays inside what is seen of the plot, and off what is drawn there."""

from __future__ import annotations

import numpy as np
import pyqtgraph as pg

from render.base.arrays import Float
from studio.qt.core import theme

APART = 0.06
"""Of its width, between the place and the text."""
OFF = 0.35
"""Of its height, between the place and a text that stands above or below it."""
FARTHEST = 4
"""Times its height, up or down, that a text is moved at most."""
OPAQUE = 215


class InsideText(pg.TextItem):  # type: ignore[misc]
    """On the side of its place that has room for it; where neither has, over the place, or above or below it."""

    def __init__(self, text: str, colour: str, beside: Float | None = None) -> None:
        """beside: (n, 2) places in the plot that the text is not to lie over, as far as it can be off them."""
        ground = pg.mkColor(theme.colours().base)
        ground.setAlpha(OPAQUE)
        super().__init__(text, color=colour, anchor=(-APART, 0.5), fill=ground)
        self.beside = np.zeros((0, 2)) if beside is None else beside

    def viewTransformChanged(self) -> None:
        """The view's range or size is another."""
        super().viewTransformChanged()
        self.keep_inside()

    def keep_inside(self) -> None:
        """A place that is out of view keeps its text beside it, out of view as well."""
        view = self.getViewBox()
        if not isinstance(view, pg.ViewBox):
            return
        seen, place = view.sceneBoundingRect(), view.mapViewToScene(self.pos())
        size = self.textItem.boundingRect()
        width, height = max(size.width(), 1.0), max(size.height(), 1.0)
        least, most = (place.x() + width - seen.right()) / width, (place.x() - seen.left()) / width
        if not 0.0 <= most * width <= seen.width():
            return
        sides = [side for side in (-APART, 1.0 + APART) if least <= side <= most]
        over = min(max(least, 0.5), most)
        steps = [sign * (OFF + step) for step in range(FARTHEST) for sign in (1.0, -1.0)]
        asked = [*((side, 0.5) for side in sides), *((over, 0.5 + step + np.sign(step) * 0.5) for step in steps)]
        asked = [one for one in asked if seen.top() <= place.y() - one[1] * height <= seen.bottom() - height]
        here = self._on_screen(view)
        covered = [self._covers(here - [place.x(), place.y()], one, width, height) for one in asked]
        best = asked[int(np.argmin(covered))] if asked else (sides[0] if sides else over, 0.5)
        if best != tuple(self.anchor):
            self.setAnchor(best)

    def _on_screen(self, view: pg.ViewBox) -> Float:
        """(n, 2) px of the scene, of what is not to be covered."""
        origin, x, y = (view.mapViewToScene(pg.Point(*one)) for one in ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0)))
        axes = np.array([[x.x() - origin.x(), x.y() - origin.y()], [y.x() - origin.x(), y.y() - origin.y()]])
        return np.asarray(self.beside @ axes + [origin.x(), origin.y()])

    @staticmethod
    def _covers(places: Float, anchor: tuple[float, float], width: float, height: float) -> int:
        """How many of (n, 2) px from its place a text lies over."""
        from_corner = places + np.array(anchor) * [width, height]
        return int(np.count_nonzero(np.all((from_corner >= 0.0) & (from_corner <= [width, height]), axis=1)))
