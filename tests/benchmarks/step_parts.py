"""STEP files of parts with many faces, for timing: a wheel, whose rim makes two faces of a thousand edges, and a plate
of studs, whose faces have few edges but for its top.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from tests.studio.project.step_text import pin

Floats = NDArray[np.float64]
UP, RIGHT = np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0])


class Entities:
    """The numbered lines of a STEP file, as they grow."""

    def __init__(self) -> None:
        self.lines: list[str] = []

    def add(self, text: str) -> int:
        number = 1001 + len(self.lines)
        self.lines.append(f"#{number}={text};")
        return number

    def point(self, at: Floats) -> int:
        return self.add(f"CARTESIAN_POINT('',{_triple(at)})")

    def direction(self, along: Floats) -> int:
        return self.add(f"DIRECTION('',{_triple(along)})")

    def vertex(self, at: Floats) -> int:
        return self.add(f"VERTEX_POINT('',#{self.point(at)})")

    def frame(self, at: Floats, z: Floats, x: Floats) -> int:
        return self.add(f"AXIS2_PLACEMENT_3D('',#{self.point(at)},#{self.direction(z)},#{self.direction(x)})")

    def line(self, a: int, b: int, start: Floats, along: Floats) -> int:
        """The edge between two vertices, the first at `start`."""
        vector = self.add(f"VECTOR('',#{self.direction(along / np.linalg.norm(along))},1.)")
        curve = self.add(f"LINE('',#{self.point(start)},#{vector})")
        return self.edge(a, b, curve)

    def edge(self, a: int, b: int, curve: int) -> int:
        return self.add(f"EDGE_CURVE('',#{a},#{b},#{curve},.T.)")

    def loop(self, edges: list[tuple[int, bool]]) -> int:
        turned = [self.add(f"ORIENTED_EDGE('',*,*,#{edge},.{'FT'[ahead]}.)") for edge, ahead in edges]
        return self.add(f"EDGE_LOOP('',({','.join(f'#{one}' for one in turned)}))")

    def face(
        self, edges: list[tuple[int, bool]], surface: int, holes: list[list[tuple[int, bool]]] | None = None
    ) -> int:
        bounds = [self.add(f"FACE_OUTER_BOUND('',#{self.loop(edges)},.T.)")]
        bounds += [self.add(f"FACE_BOUND('',#{self.loop(hole)},.T.)") for hole in holes or []]
        return self.add(f"ADVANCED_FACE('',({','.join(f'#{one}' for one in bounds)}),#{surface},.T.)")

    def plane(self, at: Floats, normal: Floats, x: Floats) -> int:
        return self.add(f"PLANE('',#{self.frame(at, normal, x)})")

    def file(self, faces: list[int]) -> str:
        """The text: all but the shell is the pin's."""
        header, rest = pin(1.0, 1.0).split("#22=")
        shell = f"#22=CLOSED_SHELL('',({','.join(f'#{one}' for one in faces)}));\n"
        return header + shell + "\n".join(self.lines) + "\n" + rest[rest.index("#80=") :]


def _triple(values: Floats) -> str:
    return "(" + ",".join(f"{value:.9f}" for value in values) + ")"


def toothed_wheel(teeth: int, radius: float, height: float) -> str:
    """A STEP file (mm) of a wheel with half-round teeth: 2 teeth + 2 faces."""
    made = Entities()
    lift, count = np.array([0.0, 0.0, height]), 2 * teeth
    angle = 2.0 * math.pi * np.arange(count) / count
    places = radius * np.column_stack([np.cos(angle), np.sin(angle), np.zeros(count)])
    vertex = [[made.vertex(at + z) for at in places] for z in (0.0 * lift, lift)]
    rims: list[list[int]] = [[], []]
    for k in range(count):
        start, along = places[k], places[(k + 1) % count] - places[k]
        for level, z in enumerate((0.0 * lift, lift)):
            a, b = vertex[level][k], vertex[level][(k + 1) % count]
            if k % 2:
                rims[level].append(made.line(a, b, start + z, along))
            else:
                placement = made.frame(start + 0.5 * along + z, UP, -along / np.linalg.norm(along))
                circle = made.add(f"CIRCLE('',#{placement},{0.5 * np.linalg.norm(along):.9f})")
                rims[level].append(made.edge(a, b, circle))
    posts = [made.line(vertex[0][k], vertex[1][k], places[k], UP) for k in range(count)]
    faces = []
    for k in range(count):
        along = places[(k + 1) % count] - places[k]
        unit = along / np.linalg.norm(along)
        if k % 2:
            surface = made.plane(places[k], np.cross(unit, UP), unit)
        else:
            placement = made.frame(places[k] + 0.5 * along, UP, unit)
            surface = made.add(f"CYLINDRICAL_SURFACE('',#{placement},{0.5 * np.linalg.norm(along):.9f})")
        ring = [(rims[0][k], True), (posts[(k + 1) % count], True), (rims[1][k], False), (posts[k], False)]
        faces.append(made.face(ring, surface))
    faces.append(made.face([(edge, True) for edge in rims[1]], made.plane(lift, UP, RIGHT)))
    faces.append(made.face([(edge, False) for edge in rims[0][::-1]], made.plane(0.0 * lift, -UP, RIGHT)))
    return made.file(faces)


def studded_plate(rows: int, columns: int, pitch: float, height: float) -> str:
    """A STEP file (mm) of a plate with round studs, each of a side and a top: 2 rows columns + 6 faces."""
    made = Entities()
    size = np.array([columns, rows]) * pitch
    corners = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]) * size
    levels = np.array([0.0, height])
    at = [[np.array([*corner, z]) for corner in corners] for z in levels]
    vertex = [[made.vertex(place) for place in level] for level in at]
    rims = [
        [made.line(vertex[i][k], vertex[i][(k + 1) % 4], at[i][k], at[i][(k + 1) % 4] - at[i][k]) for k in range(4)]
        for i in range(2)
    ]
    posts = [made.line(vertex[0][k], vertex[1][k], at[0][k], UP) for k in range(4)]
    faces = []
    for k in range(4):
        along = (at[0][(k + 1) % 4] - at[0][k]) / np.linalg.norm(at[0][(k + 1) % 4] - at[0][k])
        ring = [(rims[0][k], True), (posts[(k + 1) % 4], True), (rims[1][k], False), (posts[k], False)]
        faces.append(made.face(ring, made.plane(at[0][k], np.cross(along, UP), along)))
    faces.append(made.face([(edge, False) for edge in rims[0][::-1]], made.plane(at[0][0], -UP, RIGHT)))
    holes, radius = [], 0.3 * pitch
    for row in range(rows):
        for column in range(columns):
            foot = np.array([(column + 0.5) * pitch, (row + 0.5) * pitch, height])
            top = foot + height * UP
            low, high = made.vertex(foot + radius * RIGHT), made.vertex(top + radius * RIGHT)
            rings = [
                made.edge(end, end, made.add(f"CIRCLE('',#{made.frame(centre, UP, RIGHT)},{radius})"))
                for end, centre in ((low, foot), (high, top))
            ]
            seam = made.line(low, high, foot + radius * RIGHT, UP)
            side = made.add(f"CYLINDRICAL_SURFACE('',#{made.frame(foot, UP, RIGHT)},{radius})")
            faces.append(made.face([(rings[0], True), (seam, True), (rings[1], False), (seam, False)], side))
            faces.append(made.face([(rings[1], True)], made.plane(top, UP, RIGHT)))
            holes.append([(rings[0], False)])
    faces.append(made.face([(edge, True) for edge in rims[1]], made.plane(at[1][0], UP, RIGHT), holes))
    return made.file(faces)
