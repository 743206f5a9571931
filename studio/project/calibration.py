"""What a calibration found and how well: an error of it is common to all points, and no mean removes it."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, field_validator, model_validator

from analysis.triangulate import CALIBRATION
from render.base.errors import InputError
from render.base.model import Model, quantity
from render.camera.camera import DISTORTION_LENGTHS, MAX_SIDE, Camera, Coefficient
from studio.project.covariance import Entry, check_covariance
from studio.project.found_motion import FoundMotion
from studio.project.strict_json import brief, read_object

SIZES = tuple(len(CALIBRATION) + terms for terms in DISTORTION_LENGTHS)
Row = Annotated[tuple[Entry, ...], Field(min_length=SIZES[0], max_length=SIZES[-1])]
Covariance = Annotated[tuple[Row, ...], Field(min_length=SIZES[0], max_length=SIZES[-1])]
Component = Annotated[float, Field(ge=-1e6, le=1e6)]
Plane = tuple[Component, Component, Component, Component]

CALIBRATION_KIND, CALIBRATION_VERSION = "blazer-calibration", 1
"""What a calibration file says of itself."""


class CalibratedCamera(Model):
    """The camera as a calibration found it."""

    width: int = quantity(unit="px", label="Width", gt=0, le=MAX_SIDE)
    height: int = quantity(unit="px", label="Height", gt=0, le=MAX_SIDE)
    fx: float = quantity(unit="px", label="fx", ge=0.01, le=1e7)
    fy: float = quantity(unit="px", label="fy", ge=0.01, le=1e7)
    cx: float = quantity(unit="px", label="cx", ge=-1e6, le=1e6)
    cy: float = quantity(unit="px", label="cy", ge=-1e6, le=1e6)
    distortion: tuple[Coefficient, ...] = quantity((), label="Distortion", help="In OpenCV's order.")

    @field_validator("distortion")
    @classmethod
    def _known_length(cls, value: tuple[float, ...]) -> tuple[float, ...]:
        if len(value) not in DISTORTION_LENGTHS:
            raise ValueError(f"has {len(value)} coefficients; allowed: 0, 4, 5, 8, 12 or 14")
        return value

    def of(self, camera: Camera) -> Camera:
        """A camera with what was found in place of what it has."""
        width, height = camera.width, camera.height
        found = camera.model_copy(
            update={**{name: getattr(self, name) for name in type(self).model_fields}, "skew": 0.0}
        )
        if (width, height) == (self.width, self.height):
            return found
        scaled = found.scaled(width / self.width)
        return scaled.model_copy(update={"width": width, "height": height, "pixel_pitch": camera.pixel_pitch})


class Calibration(Model):
    """What points are made with, and its covariance; as it is, camera and lasers are the scene's, and exact."""

    camera: CalibratedCamera | None = quantity(None, label="Camera", help="None: the scene's.")
    planes: tuple[Plane, ...] = quantity(
        (),
        label="Laser planes",
        help="One for each laser: a, b, c (unit normal), d (m) in the camera's frame; none: the scene's.",
        max_length=64,
    )
    covariances: tuple[Covariance, ...] = quantity(
        (),
        label="Covariances",
        help="One matrix for each laser, of fx, fy, cx, cy (px), its plane a, b, c (unit normal), d (m) in the "
        "camera's frame, and, if it has more than 8 rows, the distortion coefficients; none: exact.",
        max_length=64,
    )

    motion: FoundMotion | None = quantity(
        None, label="Motion", help="By which a scan's points are put together; none: the scene's."
    )

    @field_validator("planes")
    @classmethod
    def _are_planes(cls, planes: tuple[Plane, ...]) -> tuple[Plane, ...]:
        for i, plane in enumerate(planes):
            if not abs(np.linalg.norm(plane[:3]) - 1.0) < 1e-3:
                raise ValueError(f"plane {i} has a normal of length {np.linalg.norm(plane[:3]):.6g}; allowed: 1")
        return planes

    @field_validator("covariances")
    @classmethod
    def _are_covariances(cls, matrices: tuple[Covariance, ...]) -> tuple[Covariance, ...]:
        for i, rows in enumerate(matrices):
            if len(rows) not in SIZES or any(len(row) != len(rows) for row in rows):
                raise ValueError(f"covariance {i} has {len(rows)} rows; allowed: a square matrix of {SIZES} rows")
            check_covariance(np.array(rows), f"covariance {i}")
        return matrices

    @model_validator(mode="after")
    def _goes_together(self) -> Calibration:
        lengths = {len(each) for each in (self.planes, self.covariances) if each}
        if len(lengths) > 1:
            raise ValueError(f"has {len(self.planes)} planes and {len(self.covariances)} covariances; allowed: as many")
        return self

    @property
    def laser_count(self) -> int:
        """Lasers that it was made for; 0: of none it says anything."""
        return max(len(self.planes), len(self.covariances))

    def covariance(self, laser: int) -> NDArray[np.float64] | None:
        """(8, 8) of `analysis.triangulate.CALIBRATION`, or with the distortion, None where a laser is exact."""
        return np.array(self.covariances[laser]) if self.covariances else None

    def plane(self, laser: int, scene_plane: NDArray[np.float64]) -> NDArray[np.float64]:
        """(4,) of a laser, the scene's where none was found."""
        return np.array(self.planes[laser]) if self.planes else scene_plane

    def camera_of(self, camera: Camera) -> Camera:
        """The camera that points are made with."""
        return camera if self.camera is None else self.camera.of(camera)

    def scaled(self, image_scale: float, camera: Camera) -> Calibration:
        """That of images with `image_scale` times the pixels a side, and so of the scaled camera."""
        matrices = []
        for rows in self.covariances:
            by = np.array([image_scale] * 4 + [1.0] * (len(rows) - 4))
            matrices.append(np.array(rows) * np.outer(by, by))
        covariances = tuple(tuple(tuple(row) for row in matrix.tolist()) for matrix in matrices)
        found = None
        if self.camera is not None:
            there = self.camera.of(camera)
            values = {name: getattr(there, name) for name in CalibratedCamera.model_fields}
            found = CalibratedCamera.model_validate(values)
        return self.model_copy(update={"camera": found, "covariances": covariances})


def read_calibration_file(path: Path, where: str) -> dict[str, Any]:
    """The JSON object of a calibration file. InputError: none, or of a later version."""
    data = read_object(path, "calibration file")
    if data.get("kind") != CALIBRATION_KIND:
        cure = "make one by main.py calibrate"
        raise InputError("the file is no calibration", where=where, allowed=CALIBRATION_KIND, cure=cure)
    version = data.get("version")
    if version != CALIBRATION_VERSION or isinstance(version, bool):
        found, allowed = brief(version), str(CALIBRATION_VERSION)
        raise InputError("a calibration of another version", where=where, found=found, allowed=allowed)
    return data


def from_file_data(data: dict[str, Any]) -> dict[str, Any]:
    """The part of a calibration file that a project takes over: camera, planes, covariances and motion."""
    return {name: data[name] for name in ("camera", "planes", "covariances", "motion") if name in data}
