"""One small scan, step by step, for the tests of this room."""

from __future__ import annotations

import pytest

import studio as blazer

SCALE = 0.1


@pytest.fixture(scope="package")
def frame() -> blazer.RenderedFrame:
    return blazer.render(blazer.Project.load("plane"), image_scale=SCALE, threads=1)


@pytest.fixture(scope="package")
def image(frame: blazer.RenderedFrame) -> blazer.DevelopedImage:
    return blazer.develop(frame)


@pytest.fixture(scope="package")
def line(image: blazer.DevelopedImage) -> blazer.ExtractedLine:
    return blazer.extract(image)


@pytest.fixture(scope="package")
def points(line: blazer.ExtractedLine) -> blazer.TriangulatedPoints:
    return blazer.triangulate(line)


@pytest.fixture(scope="package")
def errors(points: blazer.TriangulatedPoints, frame: blazer.RenderedFrame) -> blazer.PointErrors:
    return blazer.compare(points, frame)
