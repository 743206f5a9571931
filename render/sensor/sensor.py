"""The sensor, after EMVA 1288: photons, electrons, shot, dark and read noise, saturation, gain, quantisation."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from render.base.model import Model, UnitInterval, quantity

Wavelength = Annotated[float, Field(ge=1.0, le=1e5)]
ColourGain = Annotated[float, Field(ge=0.1, le=10.0)]
DEFOCUS_BY_DEPTH = "developing, by depth"
PATTERNS = Literal["RGGB", "BGGR", "GRBG", "GBRG"]


class SpectralCurve(Model):
    """A quantity sampled over wavelength; linear between the samples, zero beyond them."""

    wavelength_nm: tuple[Wavelength, ...] = quantity(unit="nm", label="Wavelengths", min_length=1, max_length=10_000)
    value: tuple[UnitInterval, ...] = quantity(label="Values", min_length=1, max_length=10_000)

    @model_validator(mode="after")
    def _pairs_ascend(self) -> SpectralCurve:
        if len(self.wavelength_nm) != len(self.value):
            raise ValueError(f"{len(self.wavelength_nm)} wavelengths for {len(self.value)} values; allowed: as many")
        if any(b <= a for a, b in zip(self.wavelength_nm, self.wavelength_nm[1:], strict=False)):
            raise ValueError("wavelengths must ascend")
        return self


class BandPass(Model):
    """An interference filter in front of the lens: transmits within centre +- width / 2, nothing else."""

    centre_nm: float = quantity(450.0, unit="nm", label="Centre", ge=200, le=2000)
    width_nm: float = quantity(20.0, unit="nm", label="Width", ge=1e-3, le=2000)
    transmission: UnitInterval = quantity(0.9, label="Transmission")


class Processing(Model):
    """What a webcam or a phone does to its raw image. Every stage is off as it stands, but colour and 8 bits."""

    white_balance: tuple[ColourGain, ColourGain, ColourGain] = quantity(
        (1.0, 1.0, 1.0), label="White balance", help="Gains of red, green and blue; what exceeds full scale is cut off."
    )
    demosaic: Literal["bilinear", "edge_aware"] = quantity(
        "bilinear", label="Demosaicing", help="How a Bayer sensor's missing colours are filled."
    )
    denoise: float = quantity(
        0.0, unit="px", label="Denoising", help="Sigma of a bilateral filter; 0: none.", ge=0, le=10
    )
    denoise_range: float = quantity(
        0.02,
        label="Denoising range",
        help="Sigma in light, as a share of full scale, that counts as alike.",
        ge=1e-4,
        le=1,
    )
    tone: Literal["linear", "gamma", "srgb"] = quantity("linear", label="Tone curve")
    gamma: float = quantity(2.2, label="Gamma", help="Of the tone curve gamma.", ge=0.2, le=5)
    sharpening: float = quantity(
        0.0, label="Sharpening", help="Share of what a blur takes away that is added; 0: none.", ge=0, le=10
    )
    sharpening_radius: float = quantity(1.0, unit="px", label="Sharpening radius", help="Sigma.", ge=0.3, le=20)
    jpeg_quality: int | None = quantity(
        None, label="JPEG quality", help="Empty: not compressed. The image is stored as it is decoded.", ge=1, le=100
    )
    chroma: Literal["4:2:0", "4:2:2", "4:4:4"] = quantity(
        "4:2:0", label="JPEG colour", help="At half the resolution in both directions, along rows, or in none."
    )


CMOS = SpectralCurve(
    wavelength_nm=(350, 400, 450, 500, 525, 550, 600, 650, 700, 750, 800, 850, 900, 950, 1000),
    value=(0.1, 0.42, 0.6, 0.66, 0.67, 0.65, 0.57, 0.46, 0.34, 0.24, 0.16, 0.1, 0.06, 0.03, 0.01),
)
"""Quantum efficiency of a typical monochrome CMOS sensor, used by the sample projects."""


class Sensor(Model):
    """An area sensor. Levels in electrons refer to one pixel; DN are the numbers in the image file."""

    colour: Literal["mono", "bayer"] = quantity("mono", label="Colour")
    pattern: PATTERNS = quantity("RGGB", label="Bayer pattern", help="Colours of the first 2 x 2 pixels.")
    efficiency: tuple[SpectralCurve, ...] = quantity(
        (CMOS,), label="Quantum efficiency", help="One curve for mono; R, G, B for Bayer.", min_length=1, max_length=3
    )
    band_pass: BandPass | None = quantity(None, label="Band-pass filter")
    exposure_time: float = quantity(1e-3, unit="s", label="Exposure time", ge=1e-9, le=1e4)
    full_well: float = quantity(10_500.0, unit="e-", label="Full well", ge=1, le=1e9)
    read_noise: float = quantity(2.5, unit="e-", label="Read noise", help="Standard deviation.", ge=0, le=1e5)
    dark_current: float = quantity(1.0, unit="e-/s", label="Dark current", ge=0, le=1e9)
    prnu: float = quantity(0.005, label="PRNU", help="Pixel-to-pixel gain spread, standard deviation.", ge=0, le=1)
    dsnu: float = quantity(0.5, unit="e-", label="DSNU", help="Pixel-to-pixel offset spread.", ge=0, le=1e5)
    bits: Literal[8, 10, 12, 16] = quantity(12, label="Bit depth")
    gain: float | None = quantity(
        None, unit="DN/e-", label="Gain", help="Empty: full well maps to the highest number.", ge=1e-9, le=1e6
    )
    black_level: float = quantity(0.0, unit="DN", label="Black level", ge=0, le=65535)
    speckle: Literal["off", "polarised", "depolarised"] = quantity(
        "off",
        label="Laser speckle",
        help="Of a rough surface, by wavelength, f-number and pixel; depolarised on paint and paper, polarised on "
        "metal. Takes about 10 ms for a line, 1 s where reflected light fills the image.",
    )
    blur_sigma: float = quantity(
        0.0,
        unit="m",
        label="Lens blur",
        help="Sigma of the lens's point spread on the sensor. Takes about 0.1 s for each light in focus.",
        ge=0,
        le=1e-3,
    )
    halo: UnitInterval = quantity(
        0.0, label="Halo", help="Share of the light in a wide halo. Takes about 0.3 s a light."
    )
    halo_sigma: float = quantity(30e-6, unit="m", label="Halo width", help="Sigma on the sensor.", ge=1e-9, le=1e-2)
    scatter: UnitInterval = quantity(
        0.0,
        label="Scatter",
        help="Share of the light that dust, smears and cheap coatings spread far beyond the halo. Takes about a second "
        "a light.",
    )
    scatter_sigma: float = quantity(
        300e-6, unit="m", label="Scatter width", help="Sigma on the sensor.", ge=1e-9, le=1e-1
    )
    defocus: bool = quantity(
        False,
        label="Defocus",
        help="Blur by each pixel's depth, after focus distance and f-number, for a lens rendered as a pinhole; a thin "
        "lens is rendered with its own and ignores this. Edges of depth are not mixed. "
        "Takes about 0.1 s for a line, seconds where light fills an image far out of focus.",
    )

    processing: Processing | None = quantity(
        None,
        label="Image processing",
        help="Of a webcam or a phone: the image is a photograph of 8 bits, in colour of a Bayer sensor, and its noise "
        "is estimated as a photograph's is. Without it the image is raw.",
    )

    @model_validator(mode="after")
    def _spread_is_a_share(self) -> Sensor:
        if self.halo + self.scatter > 1.0:
            found = f"halo {self.halo:g} and scatter {self.scatter:g} are more than all of the light"
            raise ValueError(f"{found}; allowed: 1 together")
        return self

    @model_validator(mode="after")
    def _curves_match_colour(self) -> Sensor:
        wanted = 1 if self.colour == "mono" else 3
        if len(self.efficiency) != wanted:
            raise ValueError(f"efficiency has {len(self.efficiency)} curves; allowed for {self.colour}: {wanted}")
        if self.black_level >= 2**self.bits - 1:
            raise ValueError(f"black_level {self.black_level} must be below {2**self.bits - 1} DN ({self.bits} bit)")
        return self

    def defocus_by(self, lens_model: str) -> str:
        """What blurs out of focus: never two at once. lens_model: as of `render.camera.camera.Lens`."""
        if lens_model == "thin-lens":
            return "the rendered lens"
        return DEFOCUS_BY_DEPTH if self.defocus else "nothing"

    def needs_depth(self, lens_model: str) -> bool:
        """Developing asks for the depth of pixels."""
        return self.defocus_by(lens_model) == DEFOCUS_BY_DEPTH

    @property
    def dn_per_electron(self) -> float:
        """Overall system gain, EMVA's K, DN/e-."""
        if self.gain is not None:
            return self.gain
        return (2**self.bits - 1 - self.black_level) / self.full_well
