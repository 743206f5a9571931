"""A board as a textured mesh, for projects to render: one GLB file, a rectangle with its picture."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from analysis.calibration.board import Board
from render.base.arrays import Float
from render.base.files import atomic_write
from render.mesh.texture import linear_to_srgb
from studio.calibration.board_pdf import dark_squares

WHITE, BLACK = 0.8, 0.04
"""Reflectances of paper and of ink."""
FINEST, MOST = 160, 16_000_000
"""Texels a square's side, and in all, at most."""


def write_board_mesh(path: Path, board: Board, contrast: float = 1.0) -> None:
    """The board in its own frame, m: origin at the first corner or disc, x along its row, its face towards -z.

    About it is one square's width of paper. contrast: 1 black on white; less is grey on white. A scene's object of this
    file takes the picture by the albedo {"source": "mesh"}.
    """
    import trimesh
    from PIL import Image
    from trimesh.visual.material import PBRMaterial

    size = np.array([board.columns + 3, board.rows + 3]) * board.square
    picture = Image.fromarray(_codes(WHITE - contrast * (WHITE - BLACK) * coverage(board)))
    corner = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    place = np.column_stack([corner * size - 2.0 * board.square, np.zeros(4)])
    material = PBRMaterial(baseColorTexture=picture, roughnessFactor=1.0, metallicFactor=0.0)
    # rows of a picture count downwards, v of its mapping upwards
    visual = trimesh.visual.TextureVisuals(uv=corner * [1.0, -1.0] + [0.0, 1.0], material=material)
    mesh = trimesh.Trimesh(place, [[0, 2, 1], [0, 3, 2]], visual=visual, process=False)
    with atomic_write(path) as temporary:
        temporary.write_bytes(trimesh.Scene(mesh).export(file_type="glb"))


def coverage(board: Board) -> Float:
    """(rows, columns) of texels: the share of each that is dark; edges are as sharp as texels can have them."""
    wide, high = board.columns + 3, board.rows + 3
    fine = int(min(FINEST, np.sqrt(MOST / (wide * high))))
    out = np.zeros((high * fine, wide * fine))
    edge = [np.arange(count * fine + 1) / fine - 1.0 for count in (wide, high)]  # squares, from the board's own edge
    for left, top, side in np.array(dark_squares(board)).reshape(-1, 3) / board.square:
        x, y = (np.diff(np.clip(line, low, low + side)) * fine for line, low in zip(edge, (left, top), strict=True))
        here, there = np.nonzero(y)[0], np.nonzero(x)[0]
        part = np.ix_(here, there)
        out[part] = np.maximum(out[part], y[here][:, None] * x[there])
    centres, radius = board.discs
    radius = radius / board.square * fine
    reach = np.arange(-int(np.ceil(radius)) - 1, int(np.ceil(radius)) + 2)
    in_dark = board.dots.sum(axis=1) % 2 == 0 if board.dotted else np.zeros(len(centres), dtype=bool)
    for (x, y), light in zip((2.0 + centres / board.square) * fine, in_dark, strict=True):
        columns, rows = int(x) + reach, int(y) + reach
        # of an edge the share on either side, to first order
        covered = np.clip(0.5 - np.hypot(rows[:, None] + 0.5 - y, columns + 0.5 - x) + radius, 0.0, 1.0)
        part = np.ix_(rows, columns)
        out[part] = np.minimum(out[part], 1.0 - covered) if light else np.maximum(out[part], covered)
    return np.minimum(out, 1.0)


def _codes(reflectance: Float) -> np.ndarray:
    """uint8 of sRGB, of which 8 bits resolve a hundredth of the white."""
    codes = np.rint(255.0 * linear_to_srgb(reflectance)).astype(np.uint8)
    return np.repeat(codes[:, :, None], 3, axis=2)
