"""What an emitter shines on which side, seen by a camera with nothing else about."""

import math

import numpy as np
import pytest

from render.ambient.integrator import ambient_image
from render.base.pose import Pose
from render.material.material import Emitter
from render.mesh.primitives import primitive_mesh
from render.scene.scene import SceneObject
from render.scene.shape import Plane
from tests.render.scenes import moved, paper_camera, scene_of, world_of


@pytest.mark.parametrize(("turned", "share"), [(math.pi, 1.0), (0.0, 0.0)], ids=["front", "back"])
def test_an_emitter_shines_to_its_front_alone(turned, share):
    shining = SceneObject(name="lamp", shape=Plane(), material=Emitter(radiance=(3.0, 2.0, 1.0)))
    scene = scene_of(paper_camera(0.01)).model_copy(update={"objects": (shining,)})
    # a plane's normal is +z, away from the camera until it is turned about x
    world = world_of(scene, moved(primitive_mesh(Plane()), (0.0, 0.0, 0.5), (turned, 0.0, 0.0)))
    image = ambient_image(world, scene, scene.camera, Pose().matrix, samples=4)
    assert image == pytest.approx(np.broadcast_to(share * np.array([3.0, 2.0, 1.0]), image.shape))
