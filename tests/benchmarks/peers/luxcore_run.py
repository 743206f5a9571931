"""LuxCore on one scene, in a process of its own: the film is read at each budget.

    python -m peers.luxcore_run SCENE MODE SEED FOLDER BUDGET...

MODE: path, bidir, hybrid (path tracing with light tracing for caustics), light, caches (path tracing with its photon
caches, PhotonGI, of indirect light and of caustics; biased).
"""

from __future__ import annotations

import math
import os
import sys
import time
from pathlib import Path

import numpy as np
from peers import scenes
from peers.clock import THREADS, cpu_seconds, keep_to, leave

REACH, TEXELS = 4.5, 64
BOUNCES = 9
ENGINES = {
    "path": "renderengine.type = PATHCPU\n",
    "bidir": f"renderengine.type = BIDIRCPU\nlight.maxdepth = {BOUNCES}\n",
    "hybrid": "renderengine.type = PATHCPU\npath.hybridbackforward.enable = 1\n",
    "caches": "renderengine.type = PATHCPU\npath.photongi.sampler.type = METROPOLIS\n"
    "path.photongi.indirect.enabled = 1\npath.photongi.caustic.enabled = 1\n"
    "path.photongi.photon.maxcount = 2000000\npath.photongi.indirect.maxsize = 100000\n"
    "path.photongi.caustic.maxsize = 1000000\n",
    "light": f"renderengine.type = LIGHTCPU\nlight.maxdepth = {BOUNCES}\n",
}


def material(name: str, m: scenes.Material) -> str:
    key = f"scene.materials.{name}"
    if m.kind == "diffuse":
        return f"{key}.type = matte\n{key}.kd = {m.albedo} {m.albedo} {m.albedo}\n"
    if m.kind == "glass":
        return f"{key}.type = glass\n{key}.kr = 1 1 1\n{key}.kt = 1 1 1\n{key}.interiorior = {m.n}\n"
    index = f"scene.textures.{name}_index"
    return (
        f"{index}.type = fresnelconst\n{index}.n = {m.n} {m.n} {m.n}\n{index}.k = {m.k} {m.k} {m.k}\n"
        f"{key}.type = metal2\n{key}.fresnel = {name}_index\n"
        f"{key}.uroughness = {m.alpha}\n{key}.vroughness = {m.alpha}\n"
    )


def main() -> None:
    name, mode, seed, folder, *budgets = sys.argv[1:]
    keep_to()
    import pyluxcore as lux

    lux.Init(lambda *_: None)
    scene = lux.Scene()
    # the laser: its texture is the radiant intensity, constant along the fan; square texels, the sheet across
    half, edge = REACH * scenes.SIGMA, math.tan(scenes.FAN / 2)
    texels_along = round(TEXELS * edge / half)
    intensity = scenes.POWER * scenes.sheet_profile(TEXELS, REACH) / (2 * math.sin(scenes.FAN / 2))
    picture = np.repeat(np.tile(intensity.astype(np.float32), (texels_along, 1))[..., None], 3, axis=2)
    scene.DefineImageMap("sheet", picture.ravel(), 1.0, 3, TEXELS, texels_along)
    # LuxCore lays a picture's width along its y; a narrow picture's field of view is that of its narrow side
    turned = scenes.T_WORLD_LASER @ np.array([[0, 1, 0, 0], [-1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])
    # column after column
    pose = " ".join(repr(float(x)) for x in turned.T.ravel())
    text = f"""
scene.camera.type = perspective
scene.camera.lookat.orig = 0 0 0
scene.camera.lookat.target = 0 0 1
scene.camera.up = 0 -1 0
scene.camera.screenwindow = {-scenes.WIDTH / scenes.HEIGHT} {scenes.WIDTH / scenes.HEIGHT} -1 1
scene.camera.fieldofview = {2 * math.degrees(math.atan(scenes.HEIGHT / (2 * scenes.FOCAL)))}
scene.camera.autofocus.enable = 0
scene.lights.laser.type = projection
scene.lights.laser.mapfile = sheet
scene.lights.laser.gain = 1 1 1
scene.lights.laser.power = 0
scene.lights.laser.fov = {2 * math.degrees(math.atan(half))}
scene.lights.laser.position = 0 0 0
scene.lights.laser.target = 0 0 1
scene.lights.laser.transformation = {pose}
"""
    objects = ""
    for part in scenes.setting(name).parts:
        text += material(part.name, part.material)
        points, triangles = part.vertices.astype(np.float32), part.triangles.astype(np.uint32)
        scene.DefineMeshExt(part.name, points, triangles, normals=part.smooth)
        objects += f"scene.objects.{part.name}.shape = {part.name}\nscene.objects.{part.name}.material = {part.name}\n"
    scene.Parse(lux.Properties().SetFromString(text + objects))
    config = lux.RenderConfig(
        lux.Properties().SetFromString(f"""
{ENGINES[mode]}
sampler.type = SOBOL
film.width = {scenes.WIDTH}
film.height = {scenes.HEIGHT}
film.filter.type = NONE
film.imagepipelines.0.0.type = NOP
film.outputs.0.type = RGB
film.outputs.0.filename = none.exr
native.threads.count = {THREADS}
renderengine.seed = {int(seed) + 1}
path.pathdepth.total = {BOUNCES}
path.pathdepth.diffuse = {BOUNCES}
path.pathdepth.glossy = {BOUNCES}
path.pathdepth.specular = {BOUNCES}
path.clamping.variance.maxvalue = 0
"""),
        scene,
    )
    session = lux.RenderSession(config)
    session.Start()
    start = cpu_seconds()
    pixels = np.empty(scenes.WIDTH * scenes.HEIGHT * 3, np.float32)
    for budget in (float(b) for b in budgets):
        while cpu_seconds() - start < budget:
            time.sleep(min(0.02, budget / 10))
        spent = cpu_seconds() - start
        session.UpdateStats()
        session.GetFilm().GetOutputFloat(lux.FilmOutputType.RGB, pixels)
        # bottom row first; and the film lies one row low
        image = np.roll(pixels.reshape(scenes.HEIGHT, scenes.WIDTH, 3)[::-1, :, 0], -1, axis=0)
        if mode == "bidir":
            # it counts the light of a projection twice (1.995 of the closed form on s1): halved, to judge its noise
            image = 0.5 * image
        samples = session.GetStats().Get("stats.renderengine.total.samplecount").GetFloat()
        leave(Path(folder), image, spent, samples=samples)
    # its own end of the process is a segmentation fault
    os._exit(0)


if __name__ == "__main__":
    main()
