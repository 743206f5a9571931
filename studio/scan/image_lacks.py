"""What a real scanner would meet and the image has none of, as it is switched off: speckle, and blur out of focus."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from studio.preview.estimates import BLURRED_PX, blur_px
from studio.project.project import Project
from studio.scan.speckle_remark import Measured, speckle_remark


def image_lacks(
    project: Project, measured: Sequence[Measured], known: Mapping[str, str] = {}, step: int | None = None
) -> dict[str, str]:
    """Sentences by kind, with those that were known of other frames before; measured: by laser; step: of a scan."""
    told, of = dict(known), "" if step is None else f" in step {step + 1}"
    for kind, text in (
        ("speckle", "" if "speckle" in told else speckle_remark(project, measured, of)),
        ("defocus", "" if "defocus" in told else defocus_remark(project, measured)),
    ):
        if text:
            told[kind] = text
    return told


def defocus_remark(project: Project, measured: Sequence[Measured]) -> str:
    """Of the first line that would be blurred; empty where images have the blur, or all would be sharp enough."""
    camera = project.scene.camera
    if project.sensor.defocus_by(camera.lens.model) != "nothing":
        return ""
    for one in measured:
        there = one.points.valid & ~one.errors.outlier
        if not there.any():
            continue
        blur = float(np.percentile(blur_px(camera, one.points.camera[there]), 95.0))
        if blur > BLURRED_PX:
            return (
                f"The image is sharp at any depth, as the lens is rendered as a pinhole: focused as it is set, the "
                f"line would be blurred by {blur:.1f} px. Switch on the sensor's defocus, or render a thin lens, for "
                "what a real scanner of this kind meets."
            )
    return ""
