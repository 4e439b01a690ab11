"""Small files of FBX, COLLADA, X3D, 3MF, 3DS and STEP."""

from __future__ import annotations

import io
import struct
import zipfile
from collections.abc import Mapping

import numpy as np

CORNERS = [(-1, -1, -1), (1, -1, -1), (1, 1, -1), (-1, 1, -1), (-1, -1, 1), (1, -1, 1), (1, 1, 1), (-1, 1, 1)]
QUADS = [(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]


def fbx(unit: float = 100.0, up: int = 1) -> bytes:
    """A cube of ASCII FBX 7.4, from -1 to 1 of its unit (centimetres), red."""
    vertices = ",".join(str(each) for corner in CORNERS for each in corner)
    faces = ",".join(str(each) for a, b, c, d in QUADS for each in (a, b, c, -d - 1))
    return f"""; FBX 7.4.0 project file
FBXHeaderExtension: {{
    FBXVersion: 7400
}}
GlobalSettings: {{
    Version: 1000
    Properties70: {{
        P: "UpAxis", "int", "Integer", "",{up}
        P: "UpAxisSign", "int", "Integer", "",1
        P: "FrontAxis", "int", "Integer", "",{2 if up == 1 else 1}
        P: "FrontAxisSign", "int", "Integer", "",{1 if up == 1 else -1}
        P: "CoordAxis", "int", "Integer", "",0
        P: "CoordAxisSign", "int", "Integer", "",1
        P: "UnitScaleFactor", "double", "Number", "",{unit}
    }}
}}
Objects: {{
    Geometry: 1, "Geometry::", "Mesh" {{
        Vertices: *24 {{
            a: {vertices}
        }}
        PolygonVertexIndex: *24 {{
            a: {faces}
        }}
        GeometryVersion: 124
        LayerElementMaterial: 0 {{
            Version: 101
            Name: ""
            MappingInformationType: "AllSame"
            ReferenceInformationType: "IndexToDirect"
            Materials: *1 {{
                a: 0
            }}
        }}
        Layer: 0 {{
            Version: 100
            LayerElement: {{
                Type: "LayerElementMaterial"
                TypedIndex: 0
            }}
        }}
    }}
    Model: 2, "Model::Cube", "Mesh" {{
        Version: 232
    }}
    Material: 3, "Material::Red", "" {{
        Version: 102
        ShadingModel: "lambert"
        Properties70: {{
            P: "DiffuseColor", "Color", "", "A",0.8,0.1,0.1
        }}
    }}
    NodeAttribute: 4, "NodeAttribute::Lamp", "Light" {{
        Properties70: {{
            P: "Color", "Color", "", "A",1,0.5,0.25
            P: "Intensity", "Number", "", "A",100
            P: "LightType", "enum", "", "",0
        }}
    }}
    Model: 5, "Model::Lamp", "Light" {{
        Version: 232
        Properties70: {{
            P: "Lcl Translation", "Lcl Translation", "", "A",0,5,0
        }}
    }}
}}
Connections: {{
    C: "OO",2,0
    C: "OO",1,2
    C: "OO",3,2
    C: "OO",5,0
    C: "OO",4,5
}}
""".encode()


def dae(unit: float = 0.01, up: str = "Z_UP", ior: float = 1.0, texture: str = "") -> bytes:
    """A square of COLLADA in the plane of x and y, 2 of its units wide, with a camera and two lights."""
    image = f'<library_images><image id="i" name="i"><init_from>{texture}</init_from></image></library_images>'
    params = (
        '<newparam sid="s"><surface type="2D"><init_from>i</init_from></surface></newparam>'
        '<newparam sid="t"><sampler2D><source>s</source></sampler2D></newparam>'
    )
    diffuse = '<texture texture="t" texcoord="UV"/>' if texture else "<color>0.2 0.4 0.6 1</color>"
    return f"""<?xml version="1.0" encoding="utf-8"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit name="u" meter="{unit}"/><up_axis>{up}</up_axis></asset>
<library_cameras><camera id="c" name="c"><optics><technique_common><perspective><xfov>60</xfov>
<aspect_ratio>1.5</aspect_ratio><znear>.1</znear><zfar>100</zfar></perspective></technique_common></optics></camera>
</library_cameras>
<library_lights><light id="l" name="l"><technique_common><spot><color>1 1 1</color>
<falloff_angle>40</falloff_angle></spot></technique_common></light>
<light id="a" name="a"><technique_common><ambient><color>.1 .1 .1</color></ambient></technique_common></light>
</library_lights>
{image if texture else ""}
<library_effects><effect id="e"><profile_COMMON>{params if texture else ""}<technique sid="x"><lambert>
<diffuse>{diffuse}</diffuse><index_of_refraction><float>{ior}</float></index_of_refraction></lambert></technique>
</profile_COMMON></effect></library_effects>
<library_materials><material id="m" name="Blue paint"><instance_effect url="#e"/></material></library_materials>
<library_geometries><geometry id="g"><mesh>
<source id="p"><float_array id="pa" count="12">-1 -1 0 1 -1 0 1 1 0 -1 1 0</float_array><technique_common>
<accessor source="#pa" count="4" stride="3"><param name="X" type="float"/><param name="Y" type="float"/>
<param name="Z" type="float"/></accessor></technique_common></source>
<source id="w"><float_array id="wa" count="12">0 0 0 1 0 0 1 1 0 0 1 0</float_array><technique_common>
<accessor source="#wa" count="4" stride="3"><param name="S" type="float"/><param name="T" type="float"/>
<param name="P" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles count="2" material="m"><input semantic="VERTEX" source="#v" offset="0"/>
<input semantic="TEXCOORD" source="#w" offset="0" set="0"/><p>0 1 2 0 2 3</p></triangles></mesh></geometry>
</library_geometries>
<library_visual_scenes><visual_scene id="s"><node id="square" name="Square"><instance_geometry url="#g">
<bind_material><technique_common><instance_material symbol="m" target="#m"><bind_vertex_input semantic="UV"
input_semantic="TEXCOORD" input_set="0"/></instance_material></technique_common></bind_material></instance_geometry>
</node><node id="eye" name="Eye"><translate>0 0 5</translate><instance_camera url="#c"/></node>
<node id="lamp" name="Lamp"><translate>0 0 2</translate><instance_light url="#l"/></node>
<node id="amb" name="Amb"><instance_light url="#a"/></node></visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#s"/></scene></COLLADA>""".encode()


def x3d() -> bytes:
    points = " ".join(str(each) for corner in CORNERS for each in corner)
    faces = " ".join(f"{a} {b} {c} {d} -1" for a, b, c, d in QUADS)
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<X3D profile="Interchange" version="3.3"><Scene><Shape><Appearance>
<Material diffuseColor="0.1 0.7 0.1" shininess="0.5" specularColor="0.5 0.5 0.5"/></Appearance>
<IndexedFaceSet coordIndex="{faces}"><Coordinate point="{points}"/></IndexedFaceSet></Shape></Scene></X3D>""".encode()


def package_3mf(unit: str | None = None) -> bytes:
    """A tetrahedron of 10 units along x and y, 20 along z, red in sRGB."""
    attribute = "" if unit is None else f' unit="{unit}"'
    return three_mf(f"""<?xml version="1.0" encoding="UTF-8"?>
<model{attribute} xml:lang="en-US" xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02"><resources>
<basematerials id="2"><base name="Red" displaycolor="#BC0000FF"/></basematerials>
<object id="1" type="model" pid="2" pindex="0"><mesh><vertices><vertex x="0" y="0" z="0"/><vertex x="10" y="0" z="0"/>
<vertex x="0" y="10" z="0"/><vertex x="0" y="0" z="20"/></vertices><triangles><triangle v1="0" v2="2" v3="1"/>
<triangle v1="0" v2="1" v3="3"/><triangle v1="1" v2="2" v3="3"/><triangle v1="2" v2="0" v3="3"/></triangles></mesh>
</object></resources><build><item objectid="1"/></build></model>""")


def three_mf(model: str, parts: Mapping[str, str | bytes] | None = None) -> bytes:
    """A package of a model, and other parts by their names."""
    types = (
        '<?xml version="1.0" encoding="UTF-8"?><Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">'
        '<Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>'
        '<Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/></Types>'
    )
    relations = (
        '<?xml version="1.0" encoding="UTF-8"?>'
        '<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships"><Relationship '
        'Target="/3D/3dmodel.model" Id="r" Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/>'
        "</Relationships>"
    )
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as package:
        fixed = {"[Content_Types].xml": types, "_rels/.rels": relations, "3D/3dmodel.model": model}
        for name, content in (fixed | dict(parts or {})).items():
            package.writestr(name, content)
    return file.getvalue()


def _chunk(id: int, *parts: bytes) -> bytes:
    body = b"".join(parts)
    return struct.pack("<HI", id, 6 + len(body)) + body


def three_ds(texture: str = "") -> bytes:
    """A cube of 3DS with a green material, z up."""
    color = _chunk(0xA020, _chunk(0x0011, bytes([25, 178, 25])))
    name = _chunk(0xA300, texture.encode() + b"\0")
    material = _chunk(0xAFFF, _chunk(0xA000, b"Green\0"), color, _chunk(0xA200, name) if texture else b"")
    triangles = [each for a, b, c, d in QUADS for each in ((a, b, c), (a, c, d))]
    points = struct.pack("<H", 8) + b"".join(struct.pack("<3f", *corner) for corner in CORNERS)
    group = _chunk(0x4130, b"Green\0", struct.pack("<H", 12), struct.pack("<12H", *range(12)))
    faces = struct.pack("<H", 12) + b"".join(struct.pack("<4H", *each, 7) for each in triangles)
    uvs = struct.pack("<H16f", 8, *(float(each) for corner in CORNERS for each in corner[:2]))
    mesh = _chunk(0x4100, _chunk(0x4110, points), _chunk(0x4120, faces, group), _chunk(0x4140, uvs))
    return _chunk(
        0x4D4D, _chunk(0x0002, struct.pack("<I", 3)), _chunk(0x3D3D, material, _chunk(0x4000, b"Cube\0", mesh))
    )


FILES = {"fbx": fbx(), "dae": dae(), "x3d": x3d(), "3mf": package_3mf(), "3ds": three_ds()}


def box_of_step(x: float, y: float, z: float) -> bytes:
    """A box as a manifold solid of planes, in millimetres."""
    lines, numbers = list[str](), iter(range(1, 10_000))

    def add(text: str) -> str:
        number = next(numbers)
        lines.append(f"#{number}={text};")
        return f"#{number}"

    def point(p: tuple[float, ...]) -> str:
        return add(f"CARTESIAN_POINT('',({','.join(f'{each:.6f}' for each in p)}))")

    def direction(d: tuple[float, ...]) -> str:
        return add(f"DIRECTION('',({','.join(f'{each:.6f}' for each in d)}))")

    corners = [(i * x, j * y, k * z) for k in (0, 1) for j in (0, 1) for i in (0, 1)]
    vertices = [add(f"VERTEX_POINT('',{point(corner)})") for corner in corners]
    edges = dict[tuple[int, int], str]()

    def edge(a: int, b: int) -> str:
        if (key := (min(a, b), max(a, b))) not in edges:
            start, end = (np.array(corners[each], float) for each in key)
            length = float(np.linalg.norm(end - start))
            vector = add(f"VECTOR('',{direction(tuple((end - start) / length))},1.)")
            line = add(f"LINE('',{point(tuple(start))},{vector})")
            edges[key] = add(f"EDGE_CURVE('',{vertices[key[0]]},{vertices[key[1]]},{line},.T.)")
        return add(f"ORIENTED_EDGE('',*,*,{edges[key]},{'.T.' if key == (a, b) else '.F.'})")

    faces = []
    for loop in ((0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (1, 3, 7, 5), (3, 2, 6, 7), (2, 0, 4, 6)):
        ordered = ",".join(edge(loop[k], loop[(k + 1) % 4]) for k in range(4))
        outer = add(f"EDGE_LOOP('',({ordered}))")
        bound = add(f"FACE_OUTER_BOUND('',{outer},.T.)")
        a, b, c = (np.array(corners[k], float) for k in loop[:3])
        normal, along = np.cross(b - a, c - b), b - a
        axes = direction(tuple(normal / np.linalg.norm(normal))), direction(tuple(along / np.linalg.norm(along)))
        place = add(f"AXIS2_PLACEMENT_3D('',{point(tuple(a))},{axes[0]},{axes[1]})")
        plane = add(f"PLANE('',{place})")
        faces.append(add(f"ADVANCED_FACE('',({bound}),{plane},.T.)"))
    shell = add(f"CLOSED_SHELL('',({','.join(faces)}))")
    solid = add(f"MANIFOLD_SOLID_BREP('box',{shell})")
    length = add("(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.))")
    angle = add("(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.))")
    solid_angle = add("(NAMED_UNIT(*)SI_UNIT($,.STERADIAN.)SOLID_ANGLE_UNIT())")
    precision = add(f"UNCERTAINTY_MEASURE_WITH_UNIT(LENGTH_MEASURE(1.E-06),{length},'','')")
    context = add(
        f"(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT(({precision}))"
        f"GLOBAL_UNIT_ASSIGNED_CONTEXT(({length},{angle},{solid_angle}))REPRESENTATION_CONTEXT('',''))"
    )
    axes = direction((0, 0, 1)), direction((1, 0, 0))
    origin = add(f"AXIS2_PLACEMENT_3D('',{point((0, 0, 0))},{axes[0]},{axes[1]})")
    shape = add(f"ADVANCED_BREP_SHAPE_REPRESENTATION('',({origin},{solid}),{context})")
    application = add("APPLICATION_CONTEXT('automotive design')")
    add(f"APPLICATION_PROTOCOL_DEFINITION('international standard','automotive_design',2000,{application})")
    mechanical = add(f"PRODUCT_CONTEXT('',{application},'mechanical')")
    product = add(f"PRODUCT('Box','Box','',({mechanical}))")
    formation = add(f"PRODUCT_DEFINITION_FORMATION('','',{product})")
    part = add(f"PRODUCT_DEFINITION_CONTEXT('part definition',{application},'design')")
    definition = add(f"PRODUCT_DEFINITION('design','',{formation},{part})")
    of_it = add(f"PRODUCT_DEFINITION_SHAPE('','',{definition})")
    add(f"SHAPE_DEFINITION_REPRESENTATION({of_it},{shape})")
    head = (
        "ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION((''),'2;1');\nFILE_NAME('','',(''),(''),'','','');\n"
        "FILE_SCHEMA(('AUTOMOTIVE_DESIGN'));\nENDSEC;\nDATA;\n"
    )
    return (head + "\n".join(lines) + "\nENDSEC;\nEND-ISO-10303-21;\n").encode()


STEP = box_of_step(10, 20, 30)
