"""How accurately a frame is rendered."""

from __future__ import annotations

from typing import Literal

from render.base.model import Model, quantity


class DepthGoal(Model):
    """The light is known well enough for what is measured in the image."""

    depth: float = quantity(
        0.1,
        label="Error of the line",
        help="What the render's own noise may add to the position of the line in each row, over the sigma that the "
        "sensor's noise and speckle give that row.",
        ge=1e-3,
        le=10,
    )


class RenderSettings(Model):
    """Targets; the renderer works out the samples."""

    goal: DepthGoal | None = quantity(
        DepthGoal(),
        label="Goal",
        help="Reflected and ambient light end where the measured line is known well enough. Empty: where the image is, "
        "to the errors of reflected and ambient light.",
    )

    laser_error: float = quantity(
        0.003, label="Laser error", help="Target relative RMS error over the lit pixels.", gt=1e-6, le=1
    )
    transport: Literal["auto", "direct", "interreflection", "caustic", "specular-chain", "subsurface"] = quantity(
        "auto",
        label="Light transport",
        help="auto: a short pilot decides. Or the last step that is computed: direct, the lasers' light by way of one "
        "surface; interreflection, two and more; caustic, through clear glass and off mirrors; specular-chain, the "
        "same on both sides of a surface; subsurface, below surfaces.",
    )
    negligible: float = quantity(
        0.02, label="Negligible share", help="auto leaves out what adds less than this share of the light.", ge=0, le=1
    )
    indirect_error: float = quantity(
        0.1,
        label="Reflection error",
        help="Relative RMS error of the reflected light at which it ends, with a goal as well.",
        gt=1e-4,
        le=1,
    )
    light_paths: int = quantity(
        1 << 23,
        label="Most light paths",
        help="For each laser; ends the reflections in any case.",
        ge=1 << 20,
        le=1 << 40,
    )
    laser_clamp: float | None = quantity(
        None,
        label="Reflection clamp",
        unit="W/(m^2 sr)",
        help="Most radiance that one pass of reflected laser light may put into a pixel; it takes single bright pixels "
        "away, and with them light: biased. Empty: none.",
        ge=1e-9,
        le=1e12,
    )
    ambient_error: float = quantity(
        0.01,
        label="Ambient error",
        help="Target relative RMS error of the ambient light, without a goal. From 5 % on few pixels are sampled, and "
        "the others interpolated, where that reaches it.",
        gt=1e-4,
        le=1,
    )
    ambient_samples: int = quantity(
        16,
        label="Most ambient samples",
        help="Per pixel, on average; ends the ambient light in any case. Noisy places get more of them.",
        ge=1,
        le=65536,
    )
    max_bounces: int | None = quantity(
        None,
        label="Most surfaces",
        help="That ambient light may meet on its way; empty: no bound, chance ends dim paths without bias.",
        ge=1,
        le=1024,
    )
    clamp: float | None = quantity(
        None,
        label="Clamp",
        unit="W/(m^2 sr)",
        help="Most that one sample of ambient light may add by way of two or more surfaces; it takes single bright "
        "pixels away, and with them light: biased. Empty: none.",
        ge=1e-9,
        le=1e12,
    )
    truth_images: bool = quantity(True, label="Per-pixel truth", help="Depth, position, normal and object images.")
