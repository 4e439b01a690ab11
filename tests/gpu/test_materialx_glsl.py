"""What our operations compute is what the library's own GLSL computes, on the device at hand."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gpu import Renderer
from service.formats.read.materialx.document import read_document
from service.formats.read.materialx.evaluation import Places, bands
from service.formats.read.materialx.graph import Graphs
from service.formats.read.materialx.images import Images
from service.formats.read.scenes.warnings import Warnings
from service.formats.types import AssetLimits
from tests.mtlx_files import graph, mtlx, node, value, wire

pytest.importorskip("MaterialX")

SIZE = 16
UV = wire("texcoord", "far", "vector2")
XYZ = wire("position", "deep", "vector3")
SOURCES = [
    node("texcoord", "tc", "vector2"),
    node("multiply", "far", "vector2", wire("in1", "tc", "vector2"), value("in2", "7.3, 5.1", "vector2")),
    node("combine3", "deep", "vector3", wire("in1", "sx", "float"), wire("in2", "sy", "float"), value("in3", 2.7)),
    node("extract", "sx", "float", wire("in", "far", "vector2"), value("index", 0, "integer")),
    node("extract", "sy", "float", wire("in", "far", "vector2"), value("index", 1, "integer")),
    node("combine3", "hue", "color3", wire("in1", "u", "float"), wire("in2", "v", "float"), value("in3", 0.3)),
    node("extract", "u", "float", wire("in", "tc", "vector2"), value("index", 0, "integer")),
    node("extract", "v", "float", wire("in", "tc", "vector2"), value("index", 1, "integer")),
]
# Nodes by category and type; the inputs are those of one node.
NODES = [
    ("noise2d", "vector2", UV), ("noise3d", "float", XYZ),
    ("noise3d", "vector3", XYZ), ("fractal2d", "float", UV), ("fractal3d", "vector2", XYZ),
    ("fractal3d", "vector3", XYZ), ("cellnoise2d", "float", UV), ("cellnoise3d", "float", XYZ),
    ("worleynoise2d", "float", UV), ("worleynoise2d", "vector3", UV), ("worleynoise3d", "vector2", XYZ),
    ("unifiednoise2d", "float", UV + value("type", 3, "integer")), ("randomfloat", "float", wire("in", "u", "float")),
    ("hsvadjust", "color3", wire("in", "hue") + value("amount", "0.2, 0.7, 1.2", "vector3")),
    ("colorcorrect", "color3", wire("in", "hue") + value("hue", 0.3) + value("gamma", 1.7) + value("contrast", 1.2)),
    ("saturate", "color3", wire("in", "hue") + value("amount", 0.4)),
    ("range", "color3", wire("in", "hue") + value("inlow", [0.1, 0.2, 0.0]) + value("gamma", [2.0, 1.0, 0.5])),
    ("burn", "color3", wire("fg", "hue") + value("bg", [0.9, 0.7, 0.8]) + value("mix", 0.8)),
    ("dodge", "color3", wire("fg", "hue") + value("bg", [0.1, 0.2, 0.3]) + value("mix", 0.8)),
    ("overlay", "color3", wire("fg", "hue") + value("bg", [0.1, 0.6, 0.3]) + value("mix", 0.8)),
    ("rotate2d", "vector2", wire("in", "far", "vector2") + value("amount", 33.0)),
    ("rotate3d", "vector3",
     wire("in", "deep", "vector3") + value("amount", 33.0) + value("axis", "1, 2, 3", "vector3")),
    ("place2d", "vector2", wire("texcoord", "far", "vector2") + value("rotate", 40.0)),
    ("ramp4", "color3", value("valuetl", [1.0, 0.0, 0.0]) + value("valuebr", [0.0, 0.5, 1.0])),
    ("checkerboard", "color3", UV), ("acescg_to_lin_rec709", "color3", wire("in", "hue")),
    ("safepower", "color3", wire("in1", "hue") + value("in2", 2.2, "float")),
    ("smoothstep", "float", wire("in", "u", "float")),
    ("modulo", "vector2", wire("in1", "far", "vector2") + value("in2", 1.5)),
]  # fmt: skip
VERTEX = """
#version 400
in vec2 at;
out VertexData { IN } vd;
void main() { gl_Position = vec4(2.0 * at - 1.0, 0.0, 1.0); SET }
"""


def test_they_agree(gpu: Renderer) -> None:
    nodes = [node(kind, f"n{k}", type, inputs) for k, (kind, type, inputs) in enumerate(NODES)]
    outputs = {f"o{k}": f"n{k} {type}" for k, (_, type, _) in enumerate(NODES)}
    text = mtlx(graph(*SOURCES, *nodes, **outputs))
    document, shaders = read_document("a.mtlx", lambda path: text, lambda *names: None), Glsl(text, gpu.context)
    graphs = Graphs(document, "a.mtlx", Images([], lambda name: b"", AssetLimits()), Warnings(), str)
    ((_, uv),) = bands(SIZE, SIZE, SIZE)
    own = document.getNodeGraph("NG")
    for k, (kind, type, _) in enumerate(NODES):
        tree = graphs.output(own, f"o{k}")
        ours = np.broadcast_to(Places(uv).value(tree), (SIZE * SIZE, tree.size))
        theirs = shaders.picture(f"o{k}", tree.size)
        wrong = np.abs(ours - theirs).max(axis=1) > 2e-4
        # A texel may fall on the other side of a step.
        assert wrong.mean() <= 0.01, (kind, type, ours[wrong][:3], theirs[wrong][:3])
        assert np.ptp(theirs) > 0.01, f"{kind} {type} shows something"


class Glsl:
    """The library's shaders of a document, on a context of OpenGL."""

    def __init__(self, text: bytes, context: Any) -> None:
        import MaterialX as mx
        from MaterialX import PyMaterialXGenGlsl, PyMaterialXGenShader

        library, document, path = mx.createDocument(), mx.createDocument(), mx.getDefaultDataSearchPath()
        mx.loadLibraries(mx.getDefaultDataLibraryFolders(), path, library)
        document.setDataLibrary(library)
        mx.readFromXmlString(document, text.decode())
        self.graph, self.kept = document.getNodeGraph("NG"), document
        self.stages, self.context = PyMaterialXGenShader, context
        self.generator = PyMaterialXGenGlsl.GlslShaderGenerator.create()
        self.generating = PyMaterialXGenShader.GenContext(self.generator)
        self.generating.registerSourceCodeSearchPath(path)
        kinds = PyMaterialXGenShader.ShaderInterfaceType
        self.generating.getOptions().shaderInterfaceType = kinds.SHADER_INTERFACE_REDUCED
        corners = np.array([[0, 0], [1, 0], [0, 1], [1, 1]], np.float32)
        self.corners = context.buffer(corners.tobytes())

    def picture(self, output: str, size: int) -> np.ndarray:
        """(texels, size) what an output is over the unit square, from the top."""
        shader = self.generator.generate("shader", self.graph.getOutput(output), self.generating)
        pixel = shader.getSourceCode(self.stages.PIXEL_STAGE)
        reads = "texcoord_0" in pixel.partition("in VertexData")[2].partition("}")[0]
        vertex = VERTEX.replace("IN", "vec2 texcoord_0;" if reads else "vec2 unused;")
        vertex = vertex.replace("SET", f"vd.{'texcoord_0' if reads else 'unused'} = at;")
        program = self.context.program(vertex_shader=vertex, fragment_shader=pixel)
        frame = self.context.simple_framebuffer((SIZE, SIZE), 4, dtype="f4")
        frame.use()
        self.context.vertex_array(program, [(self.corners, "2f", "at")]).render(mode=5)  # a strip of triangles
        found = np.frombuffer(frame.read(components=4, dtype="f4"), np.float32).reshape(SIZE, SIZE, 4)[::-1]
        frame.release()
        program.release()
        return found.reshape(-1, 4)[:, :size]
