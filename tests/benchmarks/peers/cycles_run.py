"""Blender's Cycles on one scene, in a process of its own: an image of its own for each budget.

    python -m peers.cycles_run SCENE MODE SEED FOLDER BUDGET...

MODE: path, guided (path guiding by Open PGL on diffuse and glossy surfaces). Its Python is that of `bpy`, which wants
another numpy than ours: `bench_peers.py --interpreter cycles=PYTHON`. Counted is what rendering takes beyond a single
sample, so that building the scene is not.
"""

from __future__ import annotations

import math
import os
import sys
from pathlib import Path

import numpy as np
from peers import scenes
from peers.clock import THREADS, cpu_seconds, keep_to, leave

BOUNCES = 9
FIRST_SAMPLES = 8


def material(bpy, m: scenes.Material):
    made = bpy.data.materials.new("material")
    made.use_nodes = True
    tree = made.node_tree
    tree.nodes.clear()
    out = tree.nodes.new("ShaderNodeOutputMaterial")
    if m.kind == "diffuse":
        bsdf = tree.nodes.new("ShaderNodeBsdfDiffuse")
        bsdf.inputs["Color"].default_value = (m.albedo, m.albedo, m.albedo, 1.0)
    elif m.kind == "glass":
        bsdf = tree.nodes.new("ShaderNodeBsdfGlass")
        bsdf.inputs["Roughness"].default_value, bsdf.inputs["IOR"].default_value = 0.0, m.n
        bsdf.inputs["Color"].default_value = (1.0, 1.0, 1.0, 1.0)
    else:
        bsdf = tree.nodes.new("ShaderNodeBsdfMetallic")
        bsdf.distribution, bsdf.fresnel_type = "GGX", "PHYSICAL_CONDUCTOR"
        bsdf.inputs["IOR"].default_value, bsdf.inputs["Extinction"].default_value = (m.n,) * 3, (m.k,) * 3
        # Blender squares what it calls roughness
        bsdf.inputs["Roughness"].default_value = math.sqrt(m.alpha)
    tree.links.new(bsdf.outputs[0], out.inputs["Surface"])
    return made


def mesh(bpy, part: scenes.Part):
    made = bpy.data.meshes.new(part.name)
    made.from_pydata(part.vertices.tolist(), [], part.triangles.tolist())
    made.materials.append(material(bpy, part.material))
    if part.smooth is not None:
        made.shade_smooth()
        made.normals_split_custom_set_from_vertices(part.smooth.tolist())
    made.update()
    bpy.context.scene.collection.objects.link(bpy.data.objects.new(part.name, made))


def laser(bpy) -> None:
    """A spot without a size whose nodes turn its even intensity into the sheet's."""
    from mathutils import Matrix

    lamp = bpy.data.lights.new("laser", "SPOT")
    lamp.shadow_soft_size, lamp.spot_blend, lamp.spot_size = 0.0, 0.0, scenes.FAN * 1.1
    # W of a spot whose radiant intensity is 1
    lamp.energy, lamp.use_nodes = 4.0 * math.pi, True
    tree = lamp.node_tree
    direction = tree.nodes.new("ShaderNodeTexCoord").outputs["Normal"]
    split = tree.nodes.new("ShaderNodeSeparateXYZ")
    tree.links.new(direction, split.inputs[0])

    def apply(operation: str, *inputs):
        node = tree.nodes.new("ShaderNodeMath")
        node.operation = operation
        for socket, given in zip(node.inputs, inputs, strict=False):
            if isinstance(given, int | float):
                socket.default_value = given
            else:
                tree.links.new(given, socket)
        return node.outputs[0]

    x, y, z = split.outputs
    across = apply("MULTIPLY", apply("DIVIDE", x, z), 1.0 / scenes.SIGMA)
    along = apply("ABSOLUTE", apply("DIVIDE", y, z))
    peak = scenes.POWER / (2 * math.sin(scenes.FAN / 2)) / (scenes.SIGMA * math.sqrt(2 * math.pi))
    profile = apply("EXPONENT", apply("MULTIPLY", apply("MULTIPLY", across, across), -0.5))
    inside = apply("LESS_THAN", along, math.tan(scenes.FAN / 2))
    emission = next(node for node in tree.nodes if node.bl_idname == "ShaderNodeEmission")
    tree.links.new(apply("MULTIPLY", apply("MULTIPLY", profile, inside), peak), emission.inputs["Strength"])
    made = bpy.data.objects.new("laser", lamp)
    # Blender's lamps shine along -z
    made.matrix_world = Matrix((scenes.T_WORLD_LASER @ np.diag([1.0, -1.0, -1.0, 1.0])).tolist())
    bpy.context.scene.collection.objects.link(made)


def camera(bpy) -> None:
    from mathutils import Matrix

    lens = bpy.data.cameras.new("camera")
    lens.sensor_fit, lens.sensor_width = "HORIZONTAL", 36.0
    lens.lens, lens.clip_start = 36.0 * scenes.FOCAL / scenes.WIDTH, 0.01
    made = bpy.data.objects.new("camera", lens)
    made.matrix_world = Matrix(np.diag([1.0, -1.0, -1.0, 1.0]).tolist())
    bpy.context.scene.collection.objects.link(made)
    bpy.context.scene.camera = made


def settings(bpy, mode: str) -> None:
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = (
        scenes.WIDTH,
        scenes.HEIGHT,
        100,
    )
    scene.render.threads_mode, scene.render.threads = "FIXED", THREADS
    scene.render.use_persistent_data = True
    scene.render.image_settings.file_format, scene.render.image_settings.color_depth = "OPEN_EXR", "32"
    scene.render.image_settings.color_mode = "RGB"
    scene.world = None
    cycles = scene.cycles
    cycles.device, cycles.use_adaptive_sampling, cycles.use_denoising = "CPU", False, False
    cycles.pixel_filter_type, cycles.use_light_tree = "BOX", False
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = cycles.light_sampling_threshold = 0.0
    cycles.blur_glossy, cycles.caustics_reflective, cycles.caustics_refractive = 0.0, True, True
    cycles.max_bounces = cycles.diffuse_bounces = cycles.glossy_bounces = cycles.transmission_bounces = BOUNCES
    cycles.use_guiding = mode == "guided"
    if cycles.use_guiding:
        cycles.use_surface_guiding, cycles.use_deterministic_guiding = True, False


def main() -> None:
    name, mode, seed, folder, *budgets = sys.argv[1:]
    keep_to()
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    settings(bpy, mode)
    camera(bpy)
    laser(bpy)
    for part in scenes.setting(name).parts:
        mesh(bpy, part)
    scene, path = bpy.context.scene, str(Path(folder) / "image.exr")
    scene.render.filepath = path

    def render(samples: int, number: int) -> tuple[np.ndarray, float]:
        scene.cycles.samples, scene.cycles.seed = samples, number
        start = cpu_seconds()
        bpy.ops.render.render(write_still=True)
        spent = cpu_seconds() - start
        image = bpy.data.images.load(path, check_existing=False)
        image.colorspace_settings.name = "Non-Color"
        pixels = np.empty(scenes.WIDTH * scenes.HEIGHT * image.channels, np.float32)
        image.pixels.foreach_get(pixels)
        bpy.data.images.remove(image)
        # bottom row first
        return pixels.reshape(scenes.HEIGHT, scenes.WIDTH, -1)[::-1, :, 0], spent

    first = 1 + int(seed) * 1009
    render(1, first)
    _, build = render(1, first + 1)
    _, some = render(FIRST_SAMPLES, first + 2)
    each = max((some - build) / (FIRST_SAMPLES - 1), 1e-4)
    for number, budget in enumerate(float(b) for b in budgets):
        samples = max(1, round(budget / each))
        image, spent = render(samples, first + 3 + number)
        leave(Path(folder), image, max(spent - build, samples * each * 0.5), samples=samples)
    os.unlink(path)


if __name__ == "__main__":
    main()
