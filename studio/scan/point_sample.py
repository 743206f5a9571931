"""Points of a scan of any length, thinned evenly to as many as are worth drawing."""

from __future__ import annotations

from analysis.cloud import Cloud, merge

MOST_POINTS = 200_000


class PointSample:
    """Every point at first, then every second, fourth, ... of each cloud, as they become more."""

    def __init__(self, most: int = MOST_POINTS) -> None:
        self.most = most
        self._kept: list[Cloud] = []
        self.one_in = 1
        """Of how many points one is kept."""

    def add(self, points: Cloud) -> None:
        self._kept.append({name: column[:: self.one_in].copy() for name, column in points.items()})
        while sum(len(part["x"]) for part in self._kept) > self.most:
            self._kept = [{name: column[::2].copy() for name, column in merge(self._kept).items()}]
            self.one_in *= 2

    @property
    def points(self) -> Cloud:
        """So far, at most `most`."""
        return merge(self._kept)
