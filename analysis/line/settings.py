"""How the line is looked for: method, scan axis, detection and window. Part of the project file."""

from __future__ import annotations

from typing import Literal

from pydantic import model_validator

from render.base.model import Model, quantity

Method = Literal[
    "auto",
    "likelihood",
    "gaussian",
    "phase",
    "centre_of_mass",
    "centre_of_mass_threshold",
    "centre_of_mass_subtracted",
    "centre_of_mass_normal",
    "half_energy",
    "row_maximum",
    "linear",
    "parabola",
    "gauss_3",
    "caruana",
    "guo",
    "blais_rioux_2",
    "blais_rioux_4",
    "blais_rioux_8",
    "derivative_of_gaussian",
    "steger",
    "steger_2d",
]
Channel = Literal["auto", "mono", "red", "green", "blue"]
Pattern = Literal["RGGB", "BGGR", "GRBG", "GBRG"]


Select = Literal["strongest", "first", "last", "continuous", "learned"]


class ExtractionSettings(Model):
    """Lengths are pixels along the scan line; `width` and `smoothing` are Gaussian sigmas."""

    method: Method = quantity("likelihood", label="Method")
    axis: Literal["rows", "columns"] = quantity(
        "rows", label="Scan axis", help="Rows: one line position per image row, for a baseline along x."
    )
    peaks: int = quantity(1, label="Peaks", help="Strongest peaks kept on each scan line.", ge=1, le=16)
    select: Select = quantity(
        "strongest",
        label="Selection",
        help="Strongest: all peaks, strongest first. Others give one peak of each scan line's candidates: the first, "
        "the last, the one on the smoothest chain of peaks, or the one that a trained network takes for the line; the "
        "last two may also be none.",
    )
    chooser: str | None = quantity(
        None,
        label="Chooser",
        help="Weights (.onnx) of the learned selection, with their card beside them; empty: the program's own.",
        min_length=1,
        max_length=1000,
    )
    channel: Channel = quantity(
        "auto", label="Laser channel", help="On colour images the mean of the other two channels is subtracted."
    )
    pattern: Pattern | None = quantity(
        None, label="Bayer pattern", help="Of a raw colour image; only pixels of the laser's colour are used."
    )
    threshold: float = quantity(
        5.2, label="Detection threshold", help="Matched-filter response over its noise.", ge=1, le=1000
    )
    width: float | None = quantity(
        None, unit="px", label="Line width", help="Known sigma; empty: measured at each peak.", ge=0.2, le=200
    )
    max_width: float = quantity(20.0, unit="px", label="Widest line", help="Sigma; wider is refused.", ge=0.5, le=200)
    smoothing: float = quantity(
        0.0,
        unit="px",
        label="Smoothing",
        help="Gaussian sigma over rows and columns before the measurement. Biases curved lines; the paper used 3. "
        "Likelihood needs independent pixels and does without.",
        ge=0,
        le=20,
    )
    smooth_along: bool = quantity(
        False,
        label="Along the line",
        help="Each position by its neighbours on the line as well, over a length that the line itself tells; steps and "
        "corners stay. Takes the surface as smooth between them, and sigma as right.",
    )
    profile: Literal["integrated", "point"] = quantity(
        "integrated", label="Profile", help="Gaussian integrated over each pixel, or taken at its centre."
    )

    filter_scale: float = quantity(
        1.5,
        label="Filter width",
        help="Of derivative_of_gaussian and steger: filter sigma over line sigma.",
        ge=0.5,
        le=4,
    )

    geometry: bool = quantity(
        False,
        label="Geometric check",
        help="Only peaks that can be the laser's direct light: on its plane, within its fan, inside the working "
        "volume, no wider than its sheet. Best with the continuous selection.",
    )
    nearest: float | None = quantity(
        None, unit="m", label="Nearest depth", help="Of the working volume; empty: from the camera on.", ge=0, le=1e4
    )
    farthest: float | None = quantity(
        None, unit="m", label="Farthest depth", help="Of the working volume; empty: no end.", ge=1e-6, le=1e4
    )
    exposures: int = quantity(
        1,
        label="Exposures",
        help="Taken of every frame and fused in electrons, for lines of very different brightness. The longest is the "
        "sensor's exposure time.",
        ge=1,
        le=8,
    )
    exposure_ratio: float = quantity(
        4.0, label="Exposure ratio", help="Each exposure is shorter than the one before by this.", gt=1, le=100
    )
    spacetime: bool = quantity(
        False,
        label="Along time",
        help="Of a moving scan: the sheet's passage over each patch of surface (Curless and Levoy). Edges and textures "
        "then pull the line no more. The steps must be finer than the line's width; only whole scans can do it.",
    )

    @model_validator(mode="after")
    def _volume_is_not_empty(self) -> ExtractionSettings:
        if self.farthest is not None and (self.nearest or 0.0) >= self.farthest:
            raise ValueError(f"nearest is {self.nearest} m, farthest {self.farthest} m; allowed: nearest < farthest")
        return self

    @model_validator(mode="after")
    def _along_time_or_line(self) -> ExtractionSettings:
        if self.spacetime and self.smooth_along:
            raise ValueError("both spacetime and smooth_along are asked for; allowed: one of them")
        return self

    @model_validator(mode="after")
    def _bayer_has_colours(self) -> ExtractionSettings:
        if self.channel == "mono" and self.pattern is not None:
            raise ValueError("channel is mono; allowed with a Bayer pattern: red, green, blue, auto")
        return self
