"""A text beside a place of a plot that stays inside what is seen of the plot."""

from __future__ import annotations

import pyqtgraph as pg

from studio.qt.core import theme

APART = 0.06
"""Of its width, between the place and the text."""
OPAQUE = 215


class InsideText(pg.TextItem):  # type: ignore[misc]
    """On the side of its place that has room for it; where neither has, over the place."""

    def __init__(self, text: str, colour: str) -> None:
        ground = pg.mkColor(theme.colours().base)
        ground.setAlpha(OPAQUE)
        super().__init__(text, color=colour, anchor=(-APART, 0.5), fill=ground)

    def viewTransformChanged(self) -> None:
        """The view's range or size is another."""
        super().viewTransformChanged()
        self.keep_inside()

    def keep_inside(self) -> None:
        """A place that is out of view keeps its text beside it, out of view as well."""
        view = self.getViewBox()
        if not isinstance(view, pg.ViewBox):
            return
        seen, place = view.sceneBoundingRect(), view.mapViewToScene(self.pos()).x()
        width = max(self.textItem.boundingRect().width(), 1.0)
        least, most = (place + width - seen.right()) / width, (place - seen.left()) / width
        if not 0.0 <= most * width <= seen.width():
            return
        sides = [side for side in (-APART, 1.0 + APART) if least <= side <= most]
        along = sides[0] if sides else min(max(least, 0.5), most)
        if along != self.anchor[0]:
            self.setAnchor((along, 0.5))
