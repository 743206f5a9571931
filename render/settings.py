"""How accurately a frame is rendered."""

from __future__ import annotations

from render.model import Model, quantity


class RenderSettings(Model):
    """Targets; the renderer works out the samples."""

    laser_error: float = quantity(
        0.003, label="Laser error", help="Target relative RMS error over the lit pixels.", gt=1e-6, le=1
    )
    ambient_samples: int = quantity(16, label="Ambient samples", help="Per pixel.", ge=1, le=65536)
    truth_images: bool = quantity(True, label="Per-pixel truth", help="Depth, position, normal and object images.")
