"""What the parts of a scene stand on, beyond which a scan may go on: its planes, where there is anything else."""

from __future__ import annotations

from render.scene.scene import Scene
from render.scene.shape import Plane


def ground(scene: Scene) -> tuple[int, ...]:
    """Indices into the visible objects."""
    found = tuple(i for i, item in enumerate(scene.visible_objects) if isinstance(item.shape, Plane))
    return found if len(found) < len(scene.visible_objects) else ()
