"""The format of some bytes: by the bytes themselves, else by the content type and the name that were sent."""

import re
import struct
from codecs import BOM_UTF8, BOM_UTF16_BE, BOM_UTF16_LE
from functools import cache
from importlib import metadata
from importlib.util import find_spec
from mmap import mmap

from service.formats.types import Kind

COMPRESSIONS = ("draco", "meshopt", "ktx2")  # of meshes and images inside glTF files

MODELS = ("fbx", "dae", "3ds", "x3d")  # that Assimp reads
FOREIGN = (*MODELS, "3mf", "step")  # that are turned into glTF

# What installs the package that a format needs, and the module by which it is known to be there.
PACKAGES: dict[str, tuple[str, str]] = {
    "meshopt": ("meshopt", "meshopt"),
    "ktx2": ("opengl-basisu", "opengl_basisu"),
    "mtlx": ("sunbox-server[materialx]", "MaterialX"),
    "usd": ("sunbox-server[usd]", "pxr"),
    "step": ("sunbox-server[cad]", "cascadio"),
    **dict.fromkeys(MODELS, ("sunbox-server[models]", "cmeel")),
}

KINDS: dict[str, Kind] = {
    "obj": "mesh",
    "ply": "mesh",
    "stl": "mesh",
    "glb": "scene",
    "gltf": "scene",
    "zip": "scene",  # or "materials", by what is in it
    "mtlx": "materials",
    "usd": "scene",
    **dict.fromkeys(FOREIGN, "scene"),
    "exr": "image",
    "hdr": "image",
    "png": "image",
    "jpeg": "image",
    "webp": "image",
    "cube": "lut",
    "binary": "measured",  # of the MERL database
    "bsdf": "measured",  # of the RGL database
}

CRATE, USD_TEXT = b"PXR-USDC", b"#usda"
USD_LAYERS = (".usd", ".usda", ".usdc")  # the first file of a .usdz is one of these

MAGIC = (
    (b"\x89PNG\r\n\x1a\n", "png"),
    (b"\xff\xd8\xff", "jpeg"),
    (b"\x76\x2f\x31\x01", "exr"),
    (b"#?RADIANCE", "hdr"),
    (b"#?RGBE", "hdr"),
    (b"glTF", "glb"),
    (b"PK\x03\x04", "zip"),
    (CRATE, "usd"),
    (USD_TEXT, "usd"),
    (b"tensor_file\0", "bsdf"),
    (b"Kaydara FBX Binary", "fbx"),
    (b"ISO-10303-21;", "step"),
    (struct.pack("<3i", 90, 90, 180), "binary"),
)

CONTENT_TYPES = {
    "model/obj": "obj",
    "text/prs.wavefront-obj": "obj",
    "application/ply": "ply",
    "model/ply": "ply",
    "model/stl": "stl",
    "application/sla": "stl",
    "model/gltf-binary": "glb",
    "model/gltf+json": "gltf",
    "model/vnd.usd+zip": "usd",
    "model/vnd.usdz+zip": "usd",
    "model/vnd.usda": "usd",
    "model/vnd.collada+xml": "dae",
    "model/x3d+xml": "x3d",
    "application/vnd.ms-3mfdocument": "3mf",
    "model/3mf": "3mf",
    "model/step": "step",
    "application/zip": "zip",
    "application/x-zip-compressed": "zip",
    "application/mtlx+xml": "mtlx",
    "application/x-materialx": "mtlx",
    "image/x-exr": "exr",
    "image/aces": "exr",
    "image/vnd.radiance": "hdr",
    "image/x-hdr": "hdr",
    "image/png": "png",
    "image/jpeg": "jpeg",
    "image/webp": "webp",
}

SUFFIXES = {name: name for name in KINDS} | {"jpg": "jpeg", "pic": "hdr", "rgbe": "hdr", "usda": "usd", "usdc": "usd"}
SUFFIXES |= {"usdz": "usd", "stp": "step", "p21": "step"}

# What cannot be read, and what its program can write instead; by the first bytes, or by the name.
CAD_FILES = ("iges", "igs", "sldprt", "sldasm", "ipt", "iam", "catpart", "f3d", "prt")
UNREADABLE = (
    (b"BLENDER", ("blend",), "Blender's files are not supported; export glTF (.glb) from Blender"),
    (None, ("max",), "3ds Max's files are not supported; export FBX or glTF from 3ds Max"),
    (b"QC4DC4D6", ("c4d",), "Cinema 4D's files are not supported; export FBX or glTF from Cinema 4D"),
    (None, ("ma", "mb"), "Maya's files are not supported; export FBX or USD from Maya"),
    (b"\xff\xfe\xff\x0e", ("skp",), "SketchUp's files are not supported; export glTF or COLLADA (.dae)"),
    (None, ("hip", "hipnc"), "Houdini's files are not supported; export USD or glTF from Houdini"),
    (None, ("3dm",), "Rhino's files are not supported; export glTF, OBJ or STEP from Rhino"),
    (None, ("ztl", "zpr"), "ZBrush's files are not supported; export OBJ or FBX from ZBrush"),
    (None, ("lwo", "lws"), "LightWave's files are not supported; export FBX or OBJ"),
    (b"AC10", ("dwg", "dxf"), "AutoCAD's drawings are not supported; export STEP or FBX"),
    (None, CAD_FILES, "this CAD format is not supported; export STEP from the program that wrote it"),
)

# What is sent instead of a file by mistake: a page that shows it, and what Git has for a file that is elsewhere.
NO_FILE = re.compile(rb"\s*+(?:<!doctype html|<html|version https://git-lfs)", re.IGNORECASE)
PAGE = "this is a web page, and not the file that it may show or lead to"
POINTER = "this is a pointer of Git LFS, and not the file; `git lfs pull` fetches the file"

# Endings of models in formats that are not read, which come in zips beside their textures.
OTHER_MODELS = (
    ".3dm", ".abc", ".blend", ".c4d", ".iges", ".igs", ".lwo", ".ma", ".max", ".mb", ".skp", ".sldprt",
)  # fmt: skip
UNREAD_IMAGES = (".avif", ".heic", ".jp2", ".jxl", ".ktx2", ".svg")
UNREAD = "a model in a format that is not read; export it as glTF (.glb)"

# OBJ has no magic number: it is recognised by its first statement, after blank lines and comments.
# Possessive quantifiers: a file of blanks would otherwise take exponential time.
OBJ_START = re.compile(rb"(?:\s++|#[^\r\n]*+[\r\n])*+(?:v|vn|vt|f|o|g|s|usemtl|mtllib)[ \t]")
CUBE_START = re.compile(
    rb"(?:\s++|#[^\r\n]*+[\r\n])*+(?:TITLE|LUT_[13]D_SIZE|LUT_[13]D_INPUT_RANGE|DOMAIN_MIN|DOMAIN_MAX)[ \t]"
)
FBX_TEXT = re.compile(rb"\s*+;\s*FBX \d")
THREE_DS = 0x4D4D  # the chunk that holds all others
PACKAGE_3MF = re.compile(rb"3D/[^/\0]{1,200}\.model|3D/_rels/", re.IGNORECASE)
PLY_START = re.compile(rb"(?:\xef\xbb\xbf)?ply[ \t]*+[\r\n]")
STL_TEXT = re.compile(rb"\s*+solid\b[^\r\n]*+\s++(?:facet|endsolid)\b", re.IGNORECASE)
GLTF_TEXT = re.compile(rb"\s*\{")
# What XML has before its root; possessive for the same reason.
BEFORE_ROOT = rb"(?:\s++|<\?[^>]*+>|<!--(?:(?!-->).)*+-->|<![A-Z][^>\[]*+(?:\[[^\]]*+\]\s*+)?>)*+"
MTLX_TEXT = re.compile(BEFORE_ROOT + rb"<materialx[\s>]", re.DOTALL)
XML_TEXTS = (
    (re.compile(BEFORE_ROOT + rb"<COLLADA[\s>]", re.DOTALL), "dae"),
    (re.compile(BEFORE_ROOT + rb"<X3D[\s>]", re.DOTALL), "x3d"),
)


@cache
def missing() -> dict[str, str]:
    """The formats that cannot be read here, with what would have to be installed."""
    found = {name: package for name, (package, module) in PACKAGES.items() if find_spec(module) is None}
    return found | ({} if assimp() else {name: PACKAGES[name][0] for name in MODELS})


@cache
def assimp() -> str | None:
    """The path of Assimp's library; None where its package is not installed."""
    try:
        listed = metadata.files("cmeel-assimp") or ()
    except metadata.PackageNotFoundError:
        return None
    return next((str(file.locate()) for file in listed if str(file).endswith("lib/libassimp.so")), None)


def text(data: bytes) -> bytes:
    """A text in UTF-8 without a byte order mark (Windows writes marks, and UTF-16); other bytes are left as they
    are."""
    if data.startswith(BOM_UTF8):
        return data.removeprefix(BOM_UTF8)
    if data.startswith((BOM_UTF16_LE, BOM_UTF16_BE)):
        return data.decode("utf-16", "ignore").encode()
    return data


def decoded(data: bytes) -> str:
    """Words of a text in UTF-8, or as programs on Windows write them, whose bytes mean nothing in UTF-8."""
    try:
        return data.decode()
    except UnicodeDecodeError:
        return "".join(bytes((byte,)).decode("cp1252", "ignore") or chr(byte) for byte in data)


def sniff(data: bytes | mmap, content_type: str | None = None, filename: str | None = None) -> str | None:
    """A key of KINDS, or None where the format is unknown."""
    head = data[:65536]
    if NO_FILE.match(head):
        return None
    for magic, name in MAGIC:
        if head.startswith(magic):
            return _package(head, data, filename) if name == "zip" else name
    if PLY_START.match(head):
        return "ply"
    if head[:4] == b"RIFF" and head[8:12] == b"WEBP":
        return "webp"
    if len(data) >= 84 and len(data) == 84 + 50 * int.from_bytes(head[80:84], "little"):
        return "stl"
    words = text(head)
    if STL_TEXT.match(words):
        return "stl"
    if GLTF_TEXT.match(words) and data.find(b'"asset"') >= 0:
        return "gltf"
    if MTLX_TEXT.match(words):
        return "mtlx"
    for pattern, name in XML_TEXTS:
        if pattern.match(words):
            return name
    if FBX_TEXT.match(words):
        return "fbx"
    if len(head) >= 6 and struct.unpack_from("<HI", head) == (THREE_DS, len(data)):
        return "3ds"
    if CUBE_START.match(words):
        return "cube"
    if OBJ_START.match(words):
        return "obj"
    named = (content_type or "").partition(";")[0].strip().lower()
    if named in CONTENT_TYPES:
        return CONTENT_TYPES[named]
    return SUFFIXES.get((filename or "").rpartition(".")[2].lower())


def _package(head: bytes, data: bytes | mmap, filename: str | None) -> str:
    """The format of a zip: of USD and 3MF the zip is the file."""
    if _is_usdz(head):
        return "usd"
    # Its directory stands at the end.
    is_named = (filename or "").lower().endswith(".3mf")
    return "3mf" if is_named or PACKAGE_3MF.search(head) or PACKAGE_3MF.search(data[-65536:]) else "zip"


def advice(head: bytes, filename: str | None) -> str | None:
    """A sentence for a file of a program whose format cannot be read, or what is no file; None for any other."""
    if (found := NO_FILE.match(head)) is not None:
        return PAGE if b"<" in found[0] else POINTER
    suffix = (filename or "").rpartition(".")[2].lower()
    for magic, suffixes, said in UNREADABLE:
        if suffix in suffixes or (magic is not None and head.startswith(magic)):
            return said
    return None


def _is_usdz(head: bytes) -> bool:
    """True if the first file of a zip is a layer of USD, as the format demands."""
    name = head[30 : 30 + int.from_bytes(head[26:28], "little")]
    return name.decode("utf-8", "replace").lower().endswith(USD_LAYERS)
