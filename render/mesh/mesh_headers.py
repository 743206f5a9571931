"""The counts in a mesh file's header, checked against its length before memory of that size is allocated."""

from __future__ import annotations

import base64
import json
import re
import struct
from dataclasses import dataclass, replace
from typing import Any

from render.base.errors import InputError

MAX_FILE_BYTES = 2**29
MAX_TEXT_BYTES = 2**28
"""Limit of OBJ, OFF, glTF, and PLY and STL as text, which take some ten times their size in memory to read."""
MAX_TRIANGLES = 20_000_000
MAX_VERTICES = 3 * MAX_TRIANGLES
MAX_DEPTH = 64
MAX_PARTS = 10_000
"""Largest number of nodes, and of materials, in one file."""
GLTF_EXTENSIONS = ("KHR_materials", "KHR_lights", "EXT_texture_webp")
"""Required extensions that do not change the geometry or its UV."""
GLTF_FLOAT = 5126
EXPORT = "export the mesh again"
NUMBER = re.compile(rb"[-+]?(\d+/)*(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?/*|\d+(//?\d+)*")
OBJ_VERTEX = re.compile(rb"(?:^|\r)[ \t]*v[ \t]+[-+.\dni]", re.MULTILINE | re.IGNORECASE)
PLY_SIZES = {
    **dict.fromkeys(("char", "uchar", "int8", "uint8"), 1),
    **dict.fromkeys(("short", "ushort", "int16", "uint16", "float16"), 2),
    **dict.fromkeys(("int", "uint", "float", "int32", "uint32", "float32"), 4),
    **dict.fromkeys(("double", "int64", "uint64", "float64"), 8),
}


@dataclass(frozen=True)
class PlyElement:
    """rows: how many; least: fewest bytes that one takes in binary; values: fewest numbers; before_list: of these."""

    name: str
    rows: int
    least: int = 0
    values: int = 0
    before_list: int = 0
    lists: int = 0


def declared_faces(data: bytes, kind: str, where: str) -> int:
    """Faces that a file says it has, 0 where it does not say.

    InputError: too long for text, more than MAX_TRIANGLES faces or MAX_VERTICES vertices, more than the file can hold,
    or a glTF feature that would be read wrongly.
    """
    match kind:
        case "stl":
            return _stl(data, where)
        case "ply":
            return _ply(data, where)
        case "off":
            return _off(data, where)
        case "obj":
            check_text(data, kind, where)
            if not OBJ_VERTEX.search(data):
                found = f"no line of a vertex in {len(data)} bytes"
                raise damaged(kind, where, found, "text with lines such as v 0 0 0 and f 1 2 3")
            faces = len(re.findall(rb"^[ \t]*f\s", data, re.MULTILINE))
            check_triangle_count(faces, where)
            return faces
        case _:
            check_gltf(gltf_header(data, kind, where), where)
            return 0


def check_text(data: bytes, kind: str, where: str) -> None:
    """InputError: a text file of more than MAX_TEXT_BYTES, or that is not text."""
    if len(data) > MAX_TEXT_BYTES:
        cure = "export it as binary PLY or STL, or simplify it"
        allowed = f"at most {MAX_TEXT_BYTES} bytes of text"
        raise InputError(
            "the mesh file is too large", where=where, found=f"{len(data)} bytes", allowed=allowed, cure=cure
        )


def check_triangle_count(count: int, where: str) -> None:
    """InputError: more than MAX_TRIANGLES."""
    if count > MAX_TRIANGLES:
        raise InputError(
            "the mesh has too many triangles",
            where=where,
            found=count,
            allowed=f"at most {MAX_TRIANGLES}",
            cure="simplify the mesh, or cut it into the region that the scanner sees",
        )


def check_together(what: str, count: int, most: int, where: str) -> None:
    """InputError: with the object `where`, a scene holds more of something than it may."""
    if count > most:
        raise InputError(
            f"the scene has too many {what}",
            where=where,
            found=f"{count} with the objects before it",
            allowed=f"at most {most} in all visible objects together",
            cure="make this one or those before it smaller, or hide some",
        )


def damaged(kind: str, where: str, found: object = None, allowed: str = "a whole, valid file") -> InputError:
    """The file does not keep to its format."""
    what = f"the file cannot be read as {kind.upper()}"
    return InputError(what, where=where, found=found, allowed=allowed, cure=f"{EXPORT}, as triangles")


def bad_line(data: bytes, kind: str) -> str | None:
    """The first line of a text mesh that has not the numbers it should have, in words; None where all are well."""
    if b"\0" in data or kind in ("glb", "gltf"):
        return None
    keywords = {"obj": {b"v": 3, b"vn": 3, b"vt": 1, b"f": 3}, "stl": {b"vertex": 3}}.get(kind)
    body = keywords is not None
    for number, line in enumerate(data.splitlines(), 1):
        words = line.split(b"#", 1)[0].split()
        if not words:
            continue
        if not body:  # numbers only, after the header
            body = words[0] in (b"end_header", b"OFF")
            continue
        least = 1 if keywords is None else 1 + keywords.get(words[0].lower(), -1)
        values = words if keywords is None else words[1:]
        if least and (len(words) < least or not all(NUMBER.fullmatch(word) for word in values)):
            return f"{line.decode('latin-1').strip()[:60]!r} in line {number}"
    return None


def _check_vertices(count: int, where: str) -> None:
    if count > MAX_VERTICES:
        allowed, cure = f"at most {MAX_VERTICES}", "simplify the mesh"
        raise InputError("the mesh has too many vertices", where=where, found=count, allowed=allowed, cure=cure)


def _stl(data: bytes, where: str) -> int:
    declared = struct.unpack_from("<I", data, 80)[0] if len(data) >= 84 else 0
    if len(data) >= 84 and len(data) == 84 + 50 * declared:
        check_triangle_count(declared, where)
        return int(declared)
    if b"facet" in data[:65536].lower():
        check_text(data, "stl", where)
        faces = data.lower().count(b"endfacet")
        check_triangle_count(faces, where)
        return faces
    if len(data) < 84:
        raise damaged(
            "stl", where, f"{len(data)} bytes", "a header of 84 bytes, or text that begins with solid and facet"
        )
    found = f"a count of {declared} triangles, which take {84 + 50 * declared} bytes, in a file of {len(data)}"
    raise damaged("stl", where, found, "a count that fits the file's length")


def ply_header(data: bytes, where: str) -> tuple[bool, list[PlyElement], int]:
    """Whether a PLY is text, its elements, and where its data begins. InputError: no such header."""
    end = re.search(rb"^[ \t]*end_header[ \t]*\r?(\n|\Z)", data[:65536], re.MULTILINE)
    if not re.match(rb"ply\s", data) or end is None:
        raise damaged("ply", where, "no header", 'a header from "ply" to "end_header"')
    elements: list[PlyElement] = []
    encoding = ""
    for number, raw in enumerate(data[: end.start()].decode("latin-1").splitlines(), 1):
        words = raw.split()
        match words:
            case ["format", name, _] if name in ("ascii", "binary_little_endian", "binary_big_endian"):
                encoding = name
            case ["element", name, count] if count.isdecimal() and len(count) < 19:
                elements.append(PlyElement(name, int(count)))
            case ["property", "list", count, value, _] if elements and count in PLY_SIZES and value in PLY_SIZES:
                last = elements[-1]
                least, values, lists = last.least + PLY_SIZES[count], last.values + 1, last.lists + 1
                elements[-1] = replace(last, least=least, values=values, lists=lists)
            case ["property", value, _] if elements and value in PLY_SIZES:
                last = elements[-1]
                before = last.before_list + (last.lists == 0)
                least, values = last.least + PLY_SIZES[value], last.values + 1
                elements[-1] = replace(last, least=least, values=values, before_list=before)
            case ["ply"] | ["comment" | "obj_info", *_] | []:
                pass
            case _:
                text = raw.strip()[:60]
                raise damaged(
                    "ply", where, f"{text!r} in line {number} of the header", "format, element, property, comment"
                )
    if not encoding:
        raise damaged("ply", where, "a header without a format", "ascii, binary_little_endian or binary_big_endian")
    return encoding == "ascii", elements, end.end()


def _ply(data: bytes, where: str) -> int:
    text, elements, start = ply_header(data, where)
    if text:
        check_text(data, "ply", where)
    rows = {element.name: element.rows for element in elements}
    check_triangle_count(rows.get("face", 0), where)
    _check_vertices(rows.get("vertex", 0), where)
    # a number of text is a digit and a blank; the last may lack the blank
    least = sum(e.rows * (max(1, 2 * e.values) if text else max(1, e.least)) for e in elements) - text
    if least > len(data) - start:
        counts = ", ".join(f"{element.rows} of {element.name}" for element in elements)
        found = f"a header that says {counts}, which take at least {least} bytes, before {len(data) - start} bytes"
        raise damaged("ply", where, found, "counts that fit the file's length")
    return rows.get("face", 0)


def _off(data: bytes, where: str) -> int:
    check_text(data, "off", where)
    match = re.search(rb"OFF(?:\s|#[^\n]*\n)*(\d+)\s+(\d+)", data[:65536])
    if match is None:
        raise damaged("off", where, "no counts", "OFF, and the numbers of vertices, faces and edges")
    vertices, faces = (int(number[:18]) for number in match.groups())
    check_triangle_count(faces, where)
    _check_vertices(vertices, where)
    if 6 * vertices + 2 * faces > len(data):
        found = f"a header that says {vertices} vertices and {faces} faces in a file of {len(data)} bytes"
        raise damaged("off", where, found, "counts that fit the file's length")
    return faces


def gltf_header(data: bytes, kind: str, where: str) -> dict[str, Any]:
    """The JSON of a GLTF or GLB file. InputError: none, or not JSON."""
    if kind == "glb":
        if len(data) < 20 or data[:4] != b"glTF" or data[16:20] != b"JSON":
            raise damaged("glb", where, "no header", "glTF, version 2, a JSON chunk")
        length, chunk = struct.unpack_from("<8xII", data)
        if length != len(data) or 20 + chunk > length:
            found = f"a header that says {length} bytes, {chunk} of them JSON, in a file of {len(data)}"
            raise damaged("glb", where, found, "lengths that fit the file's")
        text = data[20 : 20 + chunk]
    else:
        text = data
    check_text(text, kind, where)
    try:
        header = json.loads(text)
    except (ValueError, RecursionError) as error:
        at = f"a fault in line {error.lineno}, column {error.colno}" if isinstance(error, json.JSONDecodeError) else ""
        raise damaged(kind, where, f"JSON with {at or 'bytes that are not UTF-8 or nested too deeply'}") from None
    if not isinstance(header, dict):
        raise damaged(kind, where, "JSON that is not an object")
    return header


def embedded_images(data: bytes, kind: str, where: str) -> dict[str, bytes]:
    """The images within a GLB or GLTF file by their place; those in files of their own are not among them."""
    header, images = gltf_header(data, kind, where), {}
    begin = 28 + struct.unpack_from("<I", data, 12)[0] if kind == "glb" else 0
    try:
        for number, image in enumerate(header.get("images", [])):
            content = b""
            if image.get("uri", "").startswith("data:"):
                content = base64.b64decode(image["uri"].partition(",")[2])
            elif kind == "glb" and "bufferView" in image:
                view = header["bufferViews"][image["bufferView"]]
                start = begin + view.get("byteOffset", 0)
                content = data[start : start + view["byteLength"]]
            else:
                continue
            images[f"images[{number}]"] = content
    except (AttributeError, IndexError, KeyError, TypeError, ValueError):
        raise damaged(kind, where, "an entry of images that is missing or of another type") from None
    return images


def check_gltf(header: dict[str, Any], where: str) -> None:
    """Refuse what trimesh passes over or misreads of glTF 2.0, and counts beyond the limits."""
    try:
        _check_counts(header, where)
        features = _unsupported(header)
    except InputError:
        raise
    except (AttributeError, IndexError, KeyError, TypeError, ValueError):
        allowed = "accessors, meshes with primitives and attributes, nodes, as glTF 2.0 has them"
        raise damaged("gltf", where, "an entry that is missing or of another type", allowed) from None
    if features:
        raise InputError(
            "the file uses a glTF feature that is not supported",
            where=where,
            found=features[0],
            cure="export it without compression, quantisation and sparse accessors",
        )


def _check_counts(header: dict[str, Any], where: str) -> None:
    accessors, meshes, nodes = (header.get(name, []) for name in ("accessors", "meshes", "nodes"))
    for number, accessor in enumerate(accessors):
        count = accessor["count"]
        if type(count) is not int or count < 0:
            raise damaged("gltf", f"{where}: accessors[{number}].count", count, "a whole number")
    # one without a buffer view is all zeros, of any number
    _check_vertices(sum(accessor["count"] for accessor in accessors if "bufferView" not in accessor), where)
    sizes = []
    for mesh in meshes:
        corners = [p.get("indices", p["attributes"].get("POSITION")) for p in mesh["primitives"]]
        sizes.append(sum(accessors[number]["count"] // 3 for number in corners if number is not None))
    shown = [node["mesh"] for node in nodes if "mesh" in node]
    check_triangle_count(sum(sizes[number] for number in shown) if shown else sum(sizes), where)
    parts = [len(mesh["primitives"]) for mesh in meshes]
    _check_tree(nodes, where)
    found = max(len(nodes), sum(parts), sum(parts[number] for number in shown))
    if found > MAX_PARTS:
        allowed, cure = f"at most {MAX_PARTS}", "join the parts before exporting the mesh"
        raise InputError("the mesh has too many parts", where=where, found=found, allowed=allowed, cure=cure)


def _check_tree(nodes: list[dict[str, Any]], where: str) -> None:
    """InputError: nodes in a circle, or more than MAX_DEPTH levels, whose placing takes the square of their number."""
    children = [node.get("children", ()) for node in nodes]
    below = {child for each in children for child in each}
    level, seen, depth = [k for k in range(len(nodes)) if k not in below], 0, 0
    while level and depth <= MAX_DEPTH and seen <= len(nodes):
        seen, depth = seen + len(level), depth + 1
        level = [child for k in level for child in children[k]]
    if seen != len(nodes):
        found = f"more than {depth} levels" if depth > MAX_DEPTH else "a node that is in a circle or twice in it"
        cure = "join the parts before exporting the mesh"
        what, allowed = "the tree of nodes cannot be followed", f"at most {MAX_DEPTH} levels, each node once"
        raise InputError(what, where=where, found=found, allowed=allowed, cure=cure)


def _unsupported(header: dict[str, Any]) -> list[str]:
    accessors = header.get("accessors", [])
    used = {
        primitive["attributes"].get(name)
        for mesh in header.get("meshes", [])
        for primitive in mesh["primitives"]
        for name in ("POSITION", "TEXCOORD_0")
    } - {None}
    unknown = [name for name in header.get("extensionsRequired", []) if not name.startswith(GLTF_EXTENSIONS)]
    features = [f"extension {name}" for name in unknown]
    features += ["sparse accessor"] * any("sparse" in accessor for accessor in accessors)
    features += ["integer positions or UV"] * any(accessors[i]["componentType"] != GLTF_FLOAT for i in used)
    return features
