"""Mesh files of every format: whole ones, ones that lie about themselves, and polygons of every shape."""

from __future__ import annotations

import functools
import json
import math
import struct
from random import Random

import numpy as np

from tests.mutations.damage import damaged

KINDS = ("ply", "ply-text", "stl", "stl-text", "obj", "off", "glb", "gltf")
Files = dict[str, bytes]
"""The mesh file first, then what it names."""


@functools.cache
def whole(kind: str, texture: bytes) -> Files:
    """A ball 60 mm across with UV and a texture, as far as the format can say so."""
    import io

    import trimesh
    from PIL import Image

    ball = trimesh.creation.uv_sphere(radius=0.03, count=(8, 10))
    uv = ball.vertices[:, :2] / 0.06 + 0.5
    image = Image.open(io.BytesIO(texture)).convert("RGB")
    if kind in ("obj", "glb", "gltf"):
        material = trimesh.visual.material.PBRMaterial(baseColorTexture=image)
        if kind == "obj":
            material = trimesh.visual.material.SimpleMaterial(image=image)
        ball.visual = trimesh.visual.TextureVisuals(uv=uv, material=material)
    suffix = kind.removesuffix("-text")
    name = f"mesh.{suffix}"
    if kind == "obj":
        text, sides = trimesh.exchange.obj.export_obj(ball, return_texture=True, mtl_name="mesh.mtl")
        return {name: text.encode(), **sides}
    if kind == "gltf":
        files = dict(ball.export(file_type="gltf"))
        return {name: files.pop("model.gltf"), **files}
    if kind == "ply":
        return {name: trimesh.exchange.ply.export_ply(ball, encoding="binary")}
    if kind == "ply-text":
        return {name: trimesh.exchange.ply.export_ply(ball, encoding="ascii")}
    content = ball.export(file_type={"stl-text": "stl_ascii"}.get(kind, kind))
    return {name: content.encode() if isinstance(content, str) else content}


def mutated(rng: Random, texture: bytes) -> Files:
    """Files of a mesh with one fault or several in one of them."""
    if rng.random() < 0.25:
        return polygons(rng)
    kind = rng.choice(KINDS)
    files = dict(whole(kind, texture))
    name = next(iter(files)) if rng.random() < 0.75 else rng.choice(list(files))
    if name.endswith((".glb", ".gltf")) and rng.random() < 0.6:
        files[name] = _other_json(files[name], rng)
    elif name.endswith(".mtl") and rng.random() < 0.7:
        files[name] = b"newmtl a\nmap_Kd " + rng.choice(SIDE_FILES).encode() + b"\nKd nan 2 -1\n"
    elif name.endswith(".obj") and rng.random() < 0.3:
        files[name] = _other_obj(files[name], rng)
    elif rng.random() < 0.06:
        del files[name]
    else:
        files[name] = damaged(files[name], rng)
    if rng.random() < 0.05:  # another format under this one's name
        other = whole(rng.choice(KINDS), texture)
        files[next(iter(whole(kind, texture)))] = next(iter(other.values()))
    return files


SIDE_FILES = (
    "mesh.mtl", "absent.png", "../outside.png", "/etc/passwd", "/dev/zero", "/dev/stdin", "fifo.png", "loop.png",
    "folder.png", "texture.png", "http://localhost/a.png", "", "a" * 300, "\x1b[31m.png", "%2e%2e/outside.png",
    "..\\outside.png", "-s 1 1 1 t.png",
)  # fmt: skip
OBJ_LINES = (
    "usemtl absent", "f 1 2", "f 1", "f", "f -1 -2 -3", "f -99999 1 2", "f 0 1 2", "f 1/1 2 3/1/1",
    "f 1//9999 2//1 3//1", "f 1/9999/1 2/1/1 3/1/1", "f a b c", "f 1.5 2 3", "v 1 2", "v nan 0 0", "v 1e400 0 0",
    "vt", "vn 0 0 0", "l 1 2", "p 1", "g [red]", "o \x1b[31m", "f 1 2 3 \\", "f 1 2 3 4 5 6 7 8 9", "v 1 2 3 4 5 6",
    "#" + "x" * 100_000, "f 1 1 1", "s off", "curv 0 1 1 2 3", "call /etc/passwd", "f 99999999999999999999 1 2",
)  # fmt: skip


def polygons(rng: Random) -> Files:
    """Faces of three to thirty corners, some of them concave, crossed, doubled, out of plane or naming no vertex."""
    kind = rng.choice(("obj", "off", "ply"))
    count, faces, vertices = rng.randint(1, 6), [], []
    for number in range(count):
        corners = rng.choice((3, 3, 4, 4, 5, 8, 30))
        first = len(vertices)
        lift = rng.choice((0.0, 0.0, 1e-3))
        for k in range(corners):
            radius = rng.choice((0.02, 0.02, 0.005))
            angle = math.tau * k / corners * rng.choice((1, 1, 1, -1))
            vertices.append((radius * math.cos(angle), radius * math.sin(angle), 0.01 * number + lift * rng.random()))
        face = list(range(first, first + corners))
        fault = rng.choice(("none", "none", "double", "cross", "outside", "negative", "few", "far"))
        if fault == "double":
            face[-1] = face[0]
        elif fault == "cross":
            rng.shuffle(face)
        elif fault == "outside":
            face[rng.randrange(corners)] = rng.choice((len(vertices), 10**6, 2**31, 10**30))
        elif fault == "negative":
            face[rng.randrange(corners)] = rng.choice((-1, -5, -(2**31)))
        elif fault == "few":
            face = face[: rng.randint(0, 2)]
        elif fault == "far":
            vertices[-1] = rng.choice(((1e30, 0, 0), (float("nan"), 0, 0), (1e300, 1e300, 0), (0, 0, 9e3)))
        faces.append(face)
    said = rng.choice((len(faces), len(faces), len(faces), len(faces) + 1, len(faces) - 1, 10**9, 0, -1))
    points = "".join("{} {} {}\n".format(*vertex) for vertex in vertices)
    if kind == "obj":
        lines = [f"v {line}\n" for line in points.splitlines()]
        offset = rng.choice((1, 1, 1, 0, -len(vertices)))
        lines += ["f " + " ".join(str(index + offset) for index in face) + "\n" for face in faces]
        return {"mesh.obj": "".join(lines).encode()}
    rows = "".join(f"{len(face)} {' '.join(map(str, face))}\n" for face in faces)
    if kind == "off":
        return {"mesh.off": f"OFF\n{len(vertices)} {said} 0\n{points}{rows}".encode()}
    size = rng.choice(("uchar", "int", "uint8", "float", "list", "double"))
    index = rng.choice(("int", "uint", "int32", "short", "uchar", "float"))
    encoding = rng.choice(("ascii", "ascii", "ascii", "binary_little_endian", "binary_big_endian", "ebcdic"))
    header = (
        f"ply\nformat {encoding} 1.0\nelement vertex {len(vertices)}\n"
        "property float x\nproperty float y\nproperty float z\n"
        f"element face {said}\nproperty list {size} {index} vertex_indices\nend_header\n"
    ).encode()
    if not encoding.startswith("binary"):
        return {"mesh.ply": header + (points + rows).encode()}
    order = "<" if "little" in encoding else ">"
    body = b"".join(struct.pack(f"{order}3f", *np.clip(vertex, -3e38, 3e38)) for vertex in vertices)
    for face in faces:
        body += struct.pack(f"{order}B", len(face)) + b"".join(
            struct.pack(f"{order}i", index % 2**31) for index in face
        )
    return {"mesh.ply": header + body}


def _other_json(content: bytes, rng: Random) -> bytes:
    """A GLTF, or the JSON of a GLB with its lengths set right."""
    from tests.mutations.values import mutated as other

    if content[:4] != b"glTF":
        return other(json.loads(content), rng)
    (length,) = struct.unpack("<I", content[12:16])
    text = other(json.loads(content[20 : 20 + length]), rng)
    text += b" " * (-len(text) % 4)
    rest = content[20 + length :]
    return struct.pack("<4sIIII", b"glTF", 2, 20 + len(text) + len(rest), len(text), 0x4E4F534A) + text + rest


def _other_obj(content: bytes, rng: Random) -> bytes:
    """Another material file, corners counted from the end, or lines that few programs write."""
    lines = content.splitlines()
    for _ in range(rng.choice((1, 3))):
        odd = rng.choice((*OBJ_LINES, f"mtllib {rng.choice(SIDE_FILES)}", f"mtllib {rng.choice(SIDE_FILES)}"))
        lines.insert(rng.randrange(len(lines) + 1), odd.encode())
    return b"\n".join(lines) + b"\n"
