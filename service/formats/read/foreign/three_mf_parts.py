"""What the XML parts of a 3MF package say, read as it comes: a triangle of a tree would take a kilobyte."""

from __future__ import annotations

from array import array
from dataclasses import dataclass, field
from xml.parsers import expat

MODEL_RELATION = "3dmodel"  # how the kind of a relationship to a model ends
CLEAR = (1.0, 1.0, 1.0, 1.0)
NONE = -1
# Elements of extensions that are not read, and what they hold.
UNREAD = {
    "beamlattice": "beam lattices",
    "slicestack": "slices",
    "booleanshape": "shapes that booleans make",
    "displacementmesh": "displaced meshes",
    "levelset": "implicit shapes",
}
# Attributes of triangles by which slicers paint parts of them.
PAINT = {"paint_color", "slic3rpe:mmu_segmentation"}
PAINTED = "colours that a slicer painted"


@dataclass
class Reference:
    """An object at a place: an item of the build, or a component."""

    object: str
    path: str  # of another part; "" for this one
    transform: list[float]


@dataclass
class Object:
    name: str = ""
    group: int = NONE  # of triangles that name none
    place: int = NONE
    vertices: array[float] = field(default_factory=lambda: array("d"))
    triangles: array[int] = field(default_factory=lambda: array("q"))  # three vertices, a group, three of its rows
    components: list[Reference] = field(default_factory=list)


@dataclass
class Group:
    """Properties in the order of their places: colours with opacity (`base`, `color`), coordinates (`texture`)."""

    kind: str
    display: str = ""  # base: the group of display properties; texture: the texture
    rows: list[tuple[float, ...]] = field(default_factory=list)
    names: list[str] = field(default_factory=list)
    layers: list[str] = field(default_factory=list)  # groups, of whose rows each row here names one
    mixed: list[int] = field(default_factory=list)  # rows of another group, of which each row here has shares


@dataclass
class Texture:
    path: str
    u: str
    v: str


class Part:
    """What a part holds. Called by the XML parser."""

    def __init__(self) -> None:
        self.unit = "millimeter"
        self.objects: dict[str, Object] = {}
        self.groups: dict[str, Group] = {}
        self.textures: dict[str, Texture] = {}
        self.metals: dict[str, list[tuple[float, float]]] = {}
        self.items: list[Reference] = []
        self.models: list[str] = []  # parts that a relationship calls models
        self.names: list[str] = []  # ids of groups by their number in triangles
        self.unread: set[str] = set()
        self._numbers: dict[str, int] = {}
        self._object, self._group = Object(), Group("")
        self._bases: list[tuple[float, ...]] = []  # colours that composites mix
        self._metal: list[tuple[float, float]] = []

    def start(self, tag: str, found: dict[str, str]) -> None:
        name = tag.rpartition(":")[2]
        if name == "vertex":
            self._object.vertices.extend(_number(found.get(axis, "")) for axis in "xyz")
        elif name == "triangle":
            self._triangle(found)
        elif name in UNREAD:
            self.unread.add(UNREAD[name])
        elif name in _READERS:
            _READERS[name](self, found)

    def _triangle(self, found: dict[str, str]) -> None:
        if not PAINT.isdisjoint(found):
            self.unread.add(PAINTED)
        given = self._object
        group, place = given.group, given.place
        if "pid" in found:
            group = self._numbered(found["pid"])
        first = _index(found["p1"]) if "p1" in found else place
        places = (first, *(_index(found[name]) if name in found else first for name in ("p2", "p3")))
        given.triangles.extend((*(_index(found.get(name, "")) for name in ("v1", "v2", "v3")), group, *places))

    def _numbered(self, id: str) -> int:
        if id not in self._numbers:
            self._numbers[id] = len(self.names)
            self.names.append(id)
        return self._numbers[id]

    def _model(self, found: dict[str, str]) -> None:
        self.unit = found.get("unit", "millimeter").strip()

    def _relationship(self, found: dict[str, str]) -> None:
        if found.get("Type", "").endswith(MODEL_RELATION):
            self.models.append(found.get("Target", ""))

    def _begin(self, found: dict[str, str]) -> None:
        group = self._numbered(found["pid"]) if "pid" in found else NONE
        self._object = Object(found.get("name", ""), group, _index(found.get("pindex", "")))
        self.objects[found.get("id", "")] = self._object

    def _component(self, found: dict[str, str]) -> None:
        self._object.components.append(_reference(found))

    def _item(self, found: dict[str, str]) -> None:
        self.items.append(_reference(found))

    def _base_group(self, found: dict[str, str]) -> None:
        self._grouped(found, Group("base", found.get("displaypropertiesid", "")))

    def _color_group(self, found: dict[str, str]) -> None:
        self._grouped(found, Group("color"))

    def _texture_group(self, found: dict[str, str]) -> None:
        self._grouped(found, Group("texture", found.get("texid", "")))

    def _composite_group(self, found: dict[str, str]) -> None:
        mixed = [_index(word) for word in found.get("matindices", "").split()]
        self._grouped(found, Group("base", mixed=mixed))
        of = self.groups.get(found.get("matid", ""))
        self._bases = [] if of is None else of.rows

    def _multi_group(self, found: dict[str, str]) -> None:
        self._grouped(found, Group("multi", layers=found.get("pids", "").split()))

    def _grouped(self, found: dict[str, str], group: Group) -> None:
        self._group = self.groups[found.get("id", "")] = group

    def _base(self, found: dict[str, str]) -> None:
        self._group.rows.append(_color(found.get("displaycolor", "")))
        self._group.names.append(found.get("name", "") or "material")

    def _color(self, found: dict[str, str]) -> None:
        self._group.rows.append(_color(found.get("color", "")))

    def _coordinates(self, found: dict[str, str]) -> None:
        self._group.rows.append((_number(found.get("u", "")), _number(found.get("v", ""))))

    def _composite(self, found: dict[str, str]) -> None:
        """Shares of base materials: their colours are mixed so."""
        shares = [_number(word) for word in found.get("values", "").split()]
        parts = [
            (share, self._bases[row])
            for share, row in zip(shares, self._group.mixed, strict=False)
            if share > 0 and 0 <= row < len(self._bases)
        ]
        total = sum(share for share, _ in parts)
        mixed = tuple(sum(share * row[k] for share, row in parts) / total for k in range(4)) if total > 0 else CLEAR
        self._group.rows.append(mixed)
        self._group.names.append("composite")

    def _multi(self, found: dict[str, str]) -> None:
        self._group.rows.append(tuple(_index(word) for word in found.get("pindices", "").split()))

    def _texture(self, found: dict[str, str]) -> None:
        wraps = found.get("tilestyleu", "wrap"), found.get("tilestylev", "wrap")
        self.textures[found.get("id", "")] = Texture(found.get("path", ""), *wraps)

    def _metal_group(self, found: dict[str, str]) -> None:
        self._metal = self.metals[found.get("id", "")] = []

    def _metallic(self, found: dict[str, str]) -> None:
        values = (_number(found.get(name, default)) for name, default in (("metallicness", "0"), ("roughness", "1")))
        metallic, roughness = (min(max(value, 0.0), 1.0) if value == value else 0.0 for value in values)
        self._metal.append((metallic, roughness))


_READERS = {
    "model": Part._model, "Relationship": Part._relationship, "object": Part._begin,
    "component": Part._component, "item": Part._item,
    "basematerials": Part._base_group, "base": Part._base, "colorgroup": Part._color_group, "color": Part._color,
    "texture2dgroup": Part._texture_group, "tex2coord": Part._coordinates, "texture2d": Part._texture,
    "compositematerials": Part._composite_group, "composite": Part._composite,
    "multiproperties": Part._multi_group, "multi": Part._multi,
    "pbmetallicdisplayproperties": Part._metal_group, "pbmetallic": Part._metallic,
}  # fmt: skip


def read_part(data: bytes) -> Part:
    """Raises expat.ExpatError. Prefixes are taken as they are, which some files use and do not declare."""
    part = Part()
    parser = expat.ParserCreate()
    parser.StartElementHandler = part.start
    parser.Parse(data, True)
    return part


def _reference(found: dict[str, str]) -> Reference:
    path = next((value for name, value in found.items() if name.rpartition(":")[2] == "path"), "")
    return Reference(found.get("objectid", ""), path, [_number(word) for word in found.get("transform", "").split()])


def _index(word: str) -> int:
    return int(word) if word.isascii() and word.isdigit() and len(word) < 16 else NONE


def _number(word: str) -> float:
    try:
        return float(word)
    except ValueError:
        return float("nan")


def _color(word: str) -> tuple[float, ...]:
    """Red, green, blue in sRGB and opacity, of #RRGGBB or #RRGGBBAA; white for others."""
    digits = word.strip().removeprefix("#")
    try:
        values = tuple(byte / 255 for byte in bytes.fromhex(digits))
    except ValueError:
        return CLEAR
    return (*values, 1.0)[:4] if len(values) in (3, 4) else CLEAR
