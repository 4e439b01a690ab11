"""USD files written as text, and packages of them."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Mapping
from pathlib import Path

from tests import asset_files as make

QUAD = """
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    point3f[] points = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]
    uniform token subdivisionScheme = "none"
"""


def usda(body: str, head: str = "metersPerUnit = 1") -> bytes:
    return f"#usda 1.0\n(\n    {head}\n)\n{body}\n".encode()


def usdz(files: Mapping[str, bytes], compression: int = zipfile.ZIP_STORED) -> bytes:
    """A package; its first file is the root."""
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", compression) as package:
        for name, data in files.items():
            package.writestr(zipfile.ZipInfo(name), data, compression)
    return out.getvalue()


def usdc(text: bytes, folder: Path) -> bytes:
    """The binary form of a layer."""
    from pxr import Sdf

    layer = Sdf.Layer.CreateAnonymous(".usda")
    layer.ImportFromString(text.decode())
    layer.Export(str(folder / "layer.usdc"))
    return (folder / "layer.usdc").read_bytes()


def mesh(name: str, more: str = "", api: str = "", body: str = QUAD) -> str:
    """A square of two metres that faces +Z, unless `body` says otherwise."""
    schemas = f'(\n    prepend apiSchemas = ["MaterialBindingAPI"]\n    {api}\n)'
    return f'def Mesh "{name}" {schemas}\n{{\n{body}\n{more}\n}}\n'


def material(
    name: str, inputs: str, nodes: str = "", kind: str = "UsdPreviewSurface", output: str = "surface"
) -> str:
    """A material at the root, whose surface is the shader S with these inputs."""
    return f"""
def Material "{name}"
{{
    token outputs:{output}.connect = </{name}/S.outputs:surface>
    def Shader "S"
    {{
        uniform token info:id = "{kind}"
        {inputs}
        token outputs:surface
    }}
    {nodes}
}}
"""


def texture(owner: str, file: str, more: str = "", st: str = "") -> str:
    """The node T of a material, and R, which reads the primvar st."""
    return f"""
    def Shader "T"
    {{
        uniform token info:id = "UsdUVTexture"
        asset inputs:file = @{file}@
        {more}
        float2 inputs:st.connect = </{owner}/{st or "R"}.outputs:result>
        float3 outputs:rgb
        float outputs:r
        float outputs:g
        float outputs:a
    }}
    def Shader "R"
    {{
        uniform token info:id = "UsdPrimvarReader_float2"
        string inputs:varname = "st"
        float2 outputs:result
    }}"""


PNG = make.png
