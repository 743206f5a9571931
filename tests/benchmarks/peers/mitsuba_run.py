"""Mitsuba 3 on one scene, in a process of its own: passes of a fixed size, an image at each budget.

python -m peers.mitsuba_run SCENE VARIANT INTEGRATOR [aimed] SEED FOLDER BUDGET...

aimed: the projector's picture is dark where the sheet meets nothing, or nothing that reflections come by way of, so
that no particle is sent there. Mitsuba has no guiding of its own (3.9).
"""

from __future__ import annotations

import glob
import math
import os
import sys
from pathlib import Path

import numpy as np
from peers import scenes
from peers.clock import cpu_seconds, keep_to, leave

REACH, TEXELS = 4.5, 64
"""The projector's picture: sigmas either side of the sheet's centre (7e-6 of the light is beyond), texels across."""
BOUNCES = 9
PASS_SHARE = 0.4
"""A pass takes about this share of the shortest budget."""


def find_llvm() -> None:
    """Point Mitsuba at an LLVM that is there; the newest knows the most processors."""
    places = [*glob.glob("/usr/lib/*/libLLVM*.so*"), *glob.glob("/usr/lib/llvm-*/lib/libLLVM*.so*")]
    if "DRJIT_LIBLLVM_PATH" not in os.environ and places:
        digits = [
            int("".join(c for c in os.path.basename(p).replace("so", "") if c.isdigit())[:2] or 0) for p in places
        ]
        os.environ["DRJIT_LIBLLVM_PATH"] = places[int(np.argmax(digits))]


def projector(mi, aim: tuple[float, float] | None = None) -> dict:
    """The laser: a projector whose texture holds irradiance on z = 1 over pi, constant radiant intensity.

    aim: the tangents along the fan between which it shines; None: the whole fan.
    """
    half = REACH * scenes.SIGMA
    edge = math.tan(scenes.FAN / 2)
    texels_along = round(TEXELS * edge / half)
    # the first row of a picture is its top
    y = (1 - (np.arange(texels_along) + 0.5) / texels_along * 2) * edge
    along = (1 + y * y) ** -1.5 / (2 * math.sin(scenes.FAN / 2))
    if aim is not None:
        along[(y < aim[0] - 2 * edge / texels_along) | (y > aim[1] + 2 * edge / texels_along)] = 0.0
    picture = scenes.POWER / math.pi * np.outer(along, scenes.sheet_profile(TEXELS, REACH)).astype(np.float32)
    origin, axis, up = scenes.T_WORLD_LASER[:3, 3], scenes.T_WORLD_LASER[:3, 2], scenes.T_WORLD_LASER[:3, 1]
    return {
        "type": "projector",
        "to_world": mi.ScalarTransform4f().look_at(origin=list(origin), target=list(origin + axis), up=list(up)),
        "fov": 2 * math.degrees(math.atan(half)),
        "fov_axis": "x",
        "irradiance": {
            "type": "bitmap",
            "bitmap": mi.Bitmap(np.repeat(picture[..., None], 3, axis=2)),
            "raw": True,
            "wrap_mode": "clamp",
        },
    }


def bsdf(material: scenes.Material) -> dict:
    if material.kind == "diffuse":
        white = {"type": "diffuse", "reflectance": {"type": "rgb", "value": material.albedo}}
        return {"type": "twosided", "sides": white}
    if material.kind == "glass":
        return {"type": "dielectric", "int_ior": material.n, "ext_ior": 1.0}
    index = {"eta": {"type": "rgb", "value": material.n}, "k": {"type": "rgb", "value": material.k}}
    metal = {"type": "roughconductor", "distribution": "ggx", "alpha": material.alpha, **index}
    return {"type": "twosided", "sides": metal}


def mesh(mi, part: scenes.Part):
    """A mesh from arrays."""
    properties = mi.Properties()
    properties["material"] = mi.load_dict(bsdf(part.material))
    out = mi.Mesh(
        part.name, len(part.vertices), len(part.triangles), has_vertex_normals=part.smooth is not None, props=properties
    )
    parameters = mi.traverse(out)
    parameters["vertex_positions"] = part.vertices.ravel()
    parameters["faces"] = part.triangles.ravel().astype(np.uint32)
    if part.smooth is not None:
        parameters["vertex_normals"] = part.smooth.ravel()
    parameters.update()
    return out


def main() -> None:
    name, variant, integrator, *more = sys.argv[1:]
    aimed = more[0] == "aimed"
    seed, folder, *budgets = more[aimed:]
    keep_to()
    find_llvm()
    import mitsuba as mi

    mi.set_variant(variant)
    wanted = [float(b) for b in budgets]
    film = {"type": "hdrfilm", "width": scenes.WIDTH, "height": scenes.HEIGHT, "component_format": "float32"}
    description = {
        "type": "scene",
        "integrator": {"type": integrator, "max_depth": BOUNCES},
        "sensor": {
            "type": "perspective",
            "fov": 2 * math.degrees(math.atan(scenes.WIDTH / (2 * scenes.FOCAL))),
            "fov_axis": "x",
            "to_world": mi.ScalarTransform4f().look_at(origin=[0, 0, 0], target=[0, 0, 1], up=[0, -1, 0]),
            "film": {**film, "rfilter": {"type": "box"}, "pixel_format": "rgb"},
            "sampler": {"type": "independent", "sample_count": 1},
        },
        "laser": projector(mi, scenes.aim(scenes.setting(name)) if aimed else None),
    }
    for part in scenes.setting(name).parts:
        description[part.name] = mesh(mi, part)
    scene = mi.load_dict(description)

    def render(samples: int, number: int) -> np.ndarray:
        return np.array(mi.render(scene, spp=samples, seed=number))[..., 0]

    # compiles; then the size of a pass that keeps its own overhead small
    first = int(seed) * 100_003
    render(1, first)
    start = cpu_seconds()
    render(1, first + 1)
    samples = max(1, int(PASS_SHARE * wanted[0] / max(cpu_seconds() - start, 1e-3)))
    render(samples, first + 2)

    total, passes, spent = np.zeros((scenes.HEIGHT, scenes.WIDTH)), 0, 0.0
    while wanted:
        start = cpu_seconds()
        image = render(samples, first + 3 + passes)
        spent += cpu_seconds() - start
        total += image
        passes += 1
        if spent >= wanted[0]:
            leave(Path(folder), total / passes, spent, samples=passes * samples)
            wanted = [b for b in wanted if b > spent]


if __name__ == "__main__":
    main()
