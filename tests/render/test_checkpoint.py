"""A render that is interrupted and goes on gives the same numbers as one that is not."""

from __future__ import annotations

import zipfile

import numpy as np
import pytest

from analysis.report.light_text import plan_lines, quality_text
from render.base.errors import Cancelled, InputError
from render.checkpoint import RenderState, read_state, state_of
from render.material.material import Conductor
from render.progressive import refine
from render.render import render_world
from render.run import Run
from render.scene.lights import Environment
from render.scene.settings import RenderSettings
from tests.render.laser_indirect.test_integrator import turned_groove
from tests.render.scenes import paper_camera, paper_laser, scene_of, world_of

SETTINGS = RenderSettings(
    transport="interreflection",
    laser_error=0.05,
    indirect_error=0.005,
    light_paths=1 << 24,
    ambient_error=1e-3,
    ambient_samples=64,
    truth_images=False,
)


@pytest.fixture(scope="module")
def groove():
    scene = scene_of(paper_camera(0.04), paper_laser(), environment=Environment(radiance=(0.1, 0.1, 0.1)))
    item = scene.objects[0].model_copy(update={"material": Conductor(roughness=0.3)})
    scene = scene.model_copy(update={"objects": (item,)})
    return world_of(scene, turned_groove()), scene


@pytest.fixture(scope="module")
def whole(groove):
    return render_world(*groove, settings=SETTINGS, run=Run(threads=1))


class Stopper:
    """Cancels at the n-th question."""

    def __init__(self, left: int) -> None:
        self.left = left

    def __call__(self) -> bool:
        self.left -= 1
        return self.left < 0


def test_a_render_that_is_interrupted_again_and_again_ends_in_the_same_bits(groove, whole, tmp_path):
    path = tmp_path / "state.npz"
    interrupted, questions = 0, 40
    while True:
        state = read_state(state_of(*groove, SETTINGS, path=path))
        try:
            frame = render_world(
                *groove, settings=SETTINGS, run=Run(threads=2, cancelled=Stopper(questions), checkpoint=state)
            )
            break
        except Cancelled:
            interrupted += 1
            questions += 20
            state.write()
    assert interrupted >= 3
    assert np.array_equal(frame.laser_indirect[0], whole.laser_indirect[0]) and frame.laser_indirect[0].max() > 0
    assert np.array_equal(frame.ambient, whole.ambient)
    assert frame.plan == whole.plan
    assert frame.quality == whole.quality and {one.reason for one in frame.quality} == {"target", "work"}


def test_a_finished_render_goes_on_to_a_smaller_error_without_beginning_anew(groove, whole):
    coarse = SETTINGS.model_copy(update={"indirect_error": 0.02})
    state = state_of(*groove, coarse)
    render_world(*groove, settings=coarse, run=Run(checkpoint=state))
    passes = state.under_way["laser 0"].passes
    state.pause()
    frames = list(refine(*groove, settings=SETTINGS, run=Run(checkpoint=state)))
    assert state.under_way["laser 0"].passes > passes > 0
    assert np.array_equal(frames[-1].laser_indirect[0], whole.laser_indirect[0])


def test_a_saved_render_of_something_else_is_refused_with_what_differs(groove, tmp_path):
    world, scene = groove
    path = tmp_path / "state.npz"
    state = state_of(world, scene, SETTINGS, path=path)
    render_world(world, scene, settings=SETTINGS, run=Run(checkpoint=state))
    assert state.write()
    assert read_state(state_of(world, scene, SETTINGS, path=path)).saved
    for settings, changes, difference in (
        (SETTINGS.model_copy(update={"negligible": 0.5}), {}, "render setting"),
        (SETTINGS, {"seed": 4}, "step or seed"),
        (SETTINGS, {"step": 1}, "step or seed"),
    ):
        with pytest.raises(InputError, match=difference):
            read_state(state_of(world, scene, settings, path=path, **changes))
    darker = scene.model_copy(update={"environment": Environment(radiance=(0.1, 0.1, 0.2))})
    with pytest.raises(InputError, match="another camera, laser, lamp"):
        read_state(state_of(world, darker, SETTINGS, path=path))


def test_a_damaged_file_is_named(groove, tmp_path):
    path = tmp_path / "state.npz"
    path.write_bytes(b"PK\x03\x04 no archive")
    with pytest.raises(InputError, match=r"damaged.*delete it"):
        read_state(state_of(*groove, SETTINGS, path=path))


def test_a_saved_render_that_asks_for_endless_memory_is_damaged(groove, tmp_path):
    path = tmp_path / "state.npz"
    np.savez(path, **{"of/version": np.array("1"), "laser 0/sum": np.zeros(3)})
    with zipfile.ZipFile(path) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    members["laser 0/sum.npy"] = members["laser 0/sum.npy"].replace(b"(3,), }        ", b"(9999999999,), }")
    with zipfile.ZipFile(path, "w") as archive:
        for name, content in members.items():
            archive.writestr(name, content)
    with pytest.raises(InputError, match="the saved render is damaged; found data cut short or changed; delete it"):
        read_state(state_of(*groove, SETTINGS, path=path))


def test_a_state_without_a_file_is_new():
    state = RenderState({"step or seed": "0, 0"})
    assert read_state(state) is state and not state.write()


def test_every_refinement_of_reflected_light_is_a_frame_and_nearer_the_last(groove):
    frames = [frame for frame in refine(*groove, settings=SETTINGS) if frame.laser_indirect]
    assert len(frames) >= 3
    told = [frame.quality_of("indirect", "laser").error for frame in frames]
    assert told == sorted(told, reverse=True) and told[-1] <= SETTINGS.indirect_error
    last = frames[-1].laser_indirect[0].astype(np.float64)
    distance = [np.sqrt(np.sum((frame.laser_indirect[0] - last) ** 2) / np.sum(last**2)) for frame in frames[:-1]]
    assert distance[0] > distance[-1] > 0


def test_a_time_limit_ends_the_render_with_every_light_group(groove):
    endless = SETTINGS.model_copy(update={"indirect_error": 1e-3, "light_paths": 1 << 40, "ambient_samples": 65536})
    frame = render_world(*groove, settings=endless, run=Run(seconds=2.0))
    assert frame.laser_indirect[0].max() > 0 and frame.ambient.mean() > 0
    assert frame.quality_of("indirect", "laser").error > 1e-3 and frame.unfinished


def test_the_clamp_is_named_and_told(groove, whole):
    clamped = SETTINGS.model_copy(update={"laser_clamp": float(whole.laser_indirect[0].max()) / 100})
    frame = render_world(*groove, settings=clamped)
    quality = frame.quality_of("indirect", "laser")
    assert frame.plan.laser_clamp == clamped.laser_clamp and whole.plan.laser_clamp is None
    assert "clamp: no pass" in "\n".join(plan_lines(frame.plan)) and "(biased)" in quality_text(quality)
    assert quality.clamped > 0 and whole.quality_of("indirect", "laser").clamped is None
    lost = quality.clamped_radiance
    kept, full = (one.laser_indirect[0].mean(dtype=np.float64) for one in (frame, whole))
    assert kept + lost == pytest.approx(full, rel=0.1) and lost > 0
