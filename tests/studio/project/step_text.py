"""A pin as a STEP file, and faces as a GLB file like those that OpenCASCADE writes."""

from __future__ import annotations

import json
import struct
from typing import Any

import numpy as np
import trimesh

BOX = trimesh.creation.box((0.02, 0.04, 0.06)).triangles
"""Area: 24 cm^2 of the ends in x, 12 in y, 8 in z, each twice."""
UNIT = {"mm": "SI_UNIT(.MILLI.,.METRE.)", "m": "SI_UNIT($,.METRE.)"}


def pin(radius: float, height: float, unit: str = "mm") -> str:
    """A closed cylinder along z from the origin, red, in a file of that unit (AP214)."""
    return f"""ISO-10303-21;
HEADER;
FILE_DESCRIPTION((''),'2;1');
FILE_NAME('pin','2026-01-01T00:00:00',(''),(''),'','','');
FILE_SCHEMA(('AUTOMOTIVE_DESIGN'));
ENDSEC;
DATA;
#1=APPLICATION_CONTEXT('core data for automotive mechanical design processes');
#2=PRODUCT_CONTEXT('',#1,'mechanical');
#3=PRODUCT('pin','pin','',(#2));
#4=PRODUCT_DEFINITION_FORMATION('','',#3);
#5=PRODUCT_DEFINITION_CONTEXT('part definition',#1,'design');
#6=PRODUCT_DEFINITION('design','',#4,#5);
#7=PRODUCT_DEFINITION_SHAPE('','',#6);
#8=SHAPE_DEFINITION_REPRESENTATION(#7,#20);
#9=( LENGTH_UNIT() NAMED_UNIT(*) {UNIT[unit]} );
#10=( NAMED_UNIT(*) PLANE_ANGLE_UNIT() SI_UNIT($,.RADIAN.) );
#11=( NAMED_UNIT(*) SI_UNIT($,.STERADIAN.) SOLID_ANGLE_UNIT() );
#12=UNCERTAINTY_MEASURE_WITH_UNIT(LENGTH_MEASURE(1.E-7),#9,'distance_accuracy_value','');
#13=( GEOMETRIC_REPRESENTATION_CONTEXT(3) GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT((#12))
GLOBAL_UNIT_ASSIGNED_CONTEXT((#9,#10,#11)) REPRESENTATION_CONTEXT('','') );
#14=CARTESIAN_POINT('',(0.,0.,0.));
#15=DIRECTION('',(0.,0.,1.));
#16=DIRECTION('',(1.,0.,0.));
#17=AXIS2_PLACEMENT_3D('',#14,#15,#16);
#20=ADVANCED_BREP_SHAPE_REPRESENTATION('',(#17,#21),#13);
#21=MANIFOLD_SOLID_BREP('pin',#22);
#22=CLOSED_SHELL('',(#30,#40,#50));
#60=CARTESIAN_POINT('',({radius},0.,0.));
#61=CARTESIAN_POINT('',({radius},0.,{height}));
#62=CARTESIAN_POINT('',(0.,0.,{height}));
#63=VERTEX_POINT('',#60);
#64=VERTEX_POINT('',#61);
#65=AXIS2_PLACEMENT_3D('',#62,#15,#16);
#66=CIRCLE('',#17,{radius});
#67=CIRCLE('',#65,{radius});
#68=VECTOR('',#15,1.);
#69=LINE('',#60,#68);
#70=EDGE_CURVE('',#63,#63,#66,.T.);
#71=EDGE_CURVE('',#64,#64,#67,.T.);
#72=EDGE_CURVE('',#63,#64,#69,.T.);
#30=ADVANCED_FACE('',(#31),#32,.T.);
#31=FACE_BOUND('',#33,.T.);
#32=CYLINDRICAL_SURFACE('',#17,{radius});
#33=EDGE_LOOP('',(#34,#35,#36,#37));
#34=ORIENTED_EDGE('',*,*,#70,.T.);
#35=ORIENTED_EDGE('',*,*,#72,.T.);
#36=ORIENTED_EDGE('',*,*,#71,.F.);
#37=ORIENTED_EDGE('',*,*,#72,.F.);
#40=ADVANCED_FACE('',(#41),#42,.F.);
#41=FACE_BOUND('',#43,.T.);
#42=PLANE('',#17);
#43=EDGE_LOOP('',(#44));
#44=ORIENTED_EDGE('',*,*,#70,.T.);
#50=ADVANCED_FACE('',(#51),#52,.T.);
#51=FACE_BOUND('',#53,.T.);
#52=PLANE('',#65);
#53=EDGE_LOOP('',(#54));
#54=ORIENTED_EDGE('',*,*,#71,.T.);
#80=COLOUR_RGB('',0.8,0.1,0.2);
#81=FILL_AREA_STYLE_COLOUR('',#80);
#82=FILL_AREA_STYLE('',(#81));
#83=SURFACE_STYLE_FILL_AREA(#82);
#84=SURFACE_SIDE_STYLE('',(#83));
#85=SURFACE_STYLE_USAGE(.BOTH.,#84);
#86=PRESENTATION_STYLE_ASSIGNMENT((#85));
#87=STYLED_ITEM('',(#86),#21);
#88=MECHANICAL_DESIGN_GEOMETRIC_PRESENTATION_REPRESENTATION('',(#87),#13);
ENDSEC;
END-ISO-10303-21;
"""


def glb(
    meshes: dict[str, list[tuple[np.ndarray, tuple[float, ...]]]],
    nodes: list[dict[str, Any]],
    normals: np.ndarray | None = None,
) -> bytes:
    """Meshes by name, each of faces (n, 3, 3) with a colour, that share no vertices; nodes as glTF has them.

    normals: of all corners of each, as their faces.
    """
    tree: dict[str, Any] = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": list(range(len(nodes)))}],
        "nodes": nodes,
        "meshes": [],
        "materials": [],
        "accessors": [],
        "bufferViews": [],
    }
    body = b""
    for name, faces in meshes.items():
        primitives = []
        for corners, colour in faces:
            points = np.asarray(corners, dtype="<f4").reshape(-1, 3)
            written = [(points, "VEC3", 5126), (np.arange(len(points), dtype="<u4"), "SCALAR", 5125)]
            if normals is not None:
                written.insert(0, (np.asarray(normals, dtype="<f4").reshape(-1, 3), "VEC3", 5126))
            for data, kind, component in written:
                tree["bufferViews"].append({"buffer": 0, "byteOffset": len(body), "byteLength": data.nbytes})
                accessor = {"bufferView": len(tree["bufferViews"]) - 1, "componentType": component, "type": kind}
                tree["accessors"].append({**accessor, "count": len(data)})
                body += data.tobytes()
            tree["materials"].append({"pbrMetallicRoughness": {"baseColorFactor": [*colour, 1.0]}})
            count = len(tree["accessors"])
            attributes = {"POSITION": count - 2}
            if normals is not None:
                attributes["NORMAL"] = count - 3
            primitives.append({"attributes": attributes, "indices": count - 1, "material": len(tree["materials"]) - 1})
        tree["meshes"].append({"name": name, "primitives": primitives})
    tree["buffers"] = [{"byteLength": len(body)}]
    head = json.dumps(tree).encode()
    head += b" " * (-len(head) % 4)
    chunks = struct.pack("<I4s", len(head), b"JSON") + head + struct.pack("<I4s", len(body), b"BIN\0") + body
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks
