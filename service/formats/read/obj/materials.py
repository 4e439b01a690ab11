"""Materials of a library as the contract's: `diffuse` where nothing but Kd scatters, else `principled`."""

from __future__ import annotations

from typing import Any

from service.formats.read.obj.mtl import Map, MtlMaterial
from service.formats.read.obj.textures import Textures
from service.formats.read.scenes.names import unique
from service.formats.read.scenes.plain_mesh import GREY, NAME
from service.formats.read.scenes.warnings import Warnings

BRIGHTEST = 1e20  # the contract's range of radiometric values
DEFAULT_IOR, MAX_IOR = 1.5, 4.0
SPECULAR_F0 = 0.08  # reflectance head-on of principled's specular 1
# The illumination models of `illum`: 0 and 1 have no highlight; 3 and 5 are mirrors; 4, 6, 7 and 9 are glass.
WITHOUT_HIGHLIGHT, MIRRORS, GLASS, REFRACTS = (0, 1), (3, 5), (4, 6, 7, 9), (6, 7)
RELIEF = 0.01  # of the model's size
DARK = 0.1  # share of Ks: a mirror whose Kd is darker than that is a metal of colour Ks
PBR = ("pr", "pm", "ps", "pc", "pcr", "map_pr", "map_pm", "map_ps", "map_pc", "map_pcr")


class Materials:
    """The materials that faces use; `documents` are the finished ones by name."""

    def __init__(
        self, library: dict[str, MtlMaterial], textures: Textures, has_uvs: bool, size: float, notes: Warnings
    ) -> None:
        """`has_uvs`: whether the mesh has texture coordinates, without which no texture is used. `size` is its
        greatest extent."""
        self.library, self.textures, self.has_uvs, self.notes = library, textures, has_uvs, notes
        self.relief = float(f"{RELIEF * size:.2g}")  # metres from black to white where a library does not say
        self.documents: dict[str, dict[str, Any]] = {}

    def add(self, name: str, place: str) -> str:
        """The document's name for the material that `usemtl` calls `name`."""
        material = self.library.get(name)
        if material is None and name:
            self.notes.add(place, f"the material {name[:80]!r} is not defined; a grey one is shown in its place")
        found = unique(name or NAME, self.documents)
        self.documents[found] = dict(GREY) if material is None else _Converter(self, material).document()
        return found


class _Converter:
    """One material. Every number is read once, and its map with it."""

    def __init__(self, owner: Materials, material: MtlMaterial) -> None:
        self.owner, self.material, self.notes = owner, material, owner.notes
        self.illum = int(min(max(material.number("illum", 2), 0), 1000))

    def document(self) -> dict[str, Any]:
        material = self.material
        opacity = self._opacity()
        is_glass = self._is_glass(opacity)
        metallic = self._scalar("pm", "map_pm", 0.0)
        is_mirror = metallic == 0 and "pm" not in material.numbers and self._is_mirror()
        document: dict[str, Any] = {"type": "principled"}
        if is_mirror:
            document |= {"base_color": self._color("ks", "map_ks", 0.0), "metallic": 1.0}
        else:
            document |= {"base_color": self._base_color(is_glass), "metallic": metallic}
            document |= self._specular(is_glass)
            self._miss_ambient(is_glass)
        document["roughness"] = self._roughness(is_sharp=is_glass or is_mirror)
        document |= self._layers()
        if is_glass:
            document["transmission"] = 1 - opacity if opacity < 1 else 1.0
        shared = self._emission() | self._relief() | self._alpha(1.0 if is_glass else opacity)
        if set(document) == {"type", "base_color", "metallic", "specular", "roughness"} and (
            document["metallic"] == document["specular"] == 0
        ):
            document = {"type": "diffuse", "albedo": document["base_color"]}
        return document | shared

    def _is_glass(self, opacity: float) -> bool:
        if self.illum not in GLASS or "map_d" in self.material.maps:
            return False
        if opacity < 1:
            return True
        says_opaque = "d" in self.material.numbers or "tr" in self.material.numbers
        return self.illum in REFRACTS and not says_opaque and max(self.material.color("tf", 0.0)) > 0

    def _is_mirror(self) -> bool:
        kd, ks = max(self.material.color("kd", 0.8)), max(self.material.color("ks", 0.0))
        return self.illum in MIRRORS and ks > 0 and kd <= DARK * ks and "map_kd" not in self.material.maps

    def _base_color(self, is_glass: bool) -> Any:
        """Kd, or for glass with a transmission filter Tf, as base_color tints transmitted light."""
        if is_glass and max(self.material.color("tf", 0.0)) > 0:
            return _plain(self._fraction("tf", 0.0))
        return self._color("kd", "map_kd", 0.8)

    def _miss_ambient(self, is_glass: bool) -> None:
        """Warn about a colour that only Ka has: most files repeat Kd there, or say 1."""
        numbers, maps, places = self.material.numbers, self.material.maps, self.material.places
        if "map_ka" in places and "map_kd" not in maps:
            self.notes.add(places["map_ka"], "a texture of ambient light (map_Ka) is not used; map_Kd is")
        elif "ka" in places and not (
            is_glass
            or any(any(numbers.get(keyword, ())) for keyword in ("kd", "ks", "ke"))
            or any(keyword in maps for keyword in ("map_kd", "map_ks", "map_ke"))
        ):
            self.notes.add(places["ka"], "a colour of ambient light (Ka) is not used; Kd is")

    def _specular(self, is_glass: bool) -> dict[str, Any]:
        """Ks as Blender writes it: 0.5 is the reflectance of a dielectric of index Ni, F0 = 2 Ks F(Ni).

        Where only Kd is given nothing shines, and with Pr and its like the dielectric is an ordinary one.
        """
        ior = self._ior()
        if is_glass:
            return {"ior": ior, "specular": 0.5}
        if self.illum in WITHOUT_HIGHLIGHT:
            return {"specular": 0.0}
        is_pbr = any(name in self.material.numbers or name in self.material.maps for name in PBR)
        texture = self._texture("map_ks")
        if texture is not None:
            ks = self._fraction("ks", 1.0)
            ks = ks if max(ks) else (1.0,) * 3
        else:
            ks = self._fraction("ks", 0.5 if is_pbr or "ni" in self.material.numbers else 0.0)
        strength = max(ks)
        if not strength:
            return {"specular": 0.0}
        f0 = 2 * strength * ((ior - 1) / (ior + 1)) ** 2
        level: dict[str, Any] = {"specular": round(f0 / SPECULAR_F0, 6)}
        if f0 > SPECULAR_F0 * (1 + 1e-9):
            root = min(f0, 0.36) ** 0.5
            level = {"specular": 0.5, "ior": min((1 + root) / (1 - root), MAX_IOR)}
        tint = _plain(tuple(value / strength for value in ks))
        if texture is not None:
            level["specular_color"] = {"texture": texture, "factor": tint}
        elif tint != 1:
            level["specular_color"] = tint
        return level

    def _ior(self) -> float:
        """Ni, or None where it is 1 or 0, by which exporters say that they have no value."""
        ior = self.material.number("ni", DEFAULT_IOR)
        if ior > MAX_IOR:
            self.notes.add(
                self._place("ni"), f"an index (Ni) of {ior:g} is not supported; {MAX_IOR:g} is used instead"
            )
        return min(ior, MAX_IOR) if ior > 1 else DEFAULT_IOR

    def _roughness(self, is_sharp: bool) -> Any:
        """Pr, or the width of a highlight of exponent Ns: alpha^2 = 2 / (Ns + 2) [Walter et al. 2007, section 5.2].

        Glass and mirrors, for which MTL demands ray tracing, are sharp, whatever the exponent of their highlight.
        """
        if "pr" in self.material.numbers or "map_pr" in self.material.maps:
            return self._scalar("pr", "map_pr", 1.0)
        if is_sharp:
            return 0.0
        exponent = self.material.number("ns", 0.0)
        if exponent < 0:
            self.notes.add(self._place("ns"), f"an exponent (Ns) of {exponent:g} is not supported; 0 is used instead")
        return float((2 / (max(exponent, 0.0) + 2)) ** 0.25)

    def _layers(self) -> dict[str, Any]:
        """Set sheen, coat and anisotropy."""
        found: dict[str, Any] = {}
        sheen, coat = self._scalar("ps", "map_ps", 0.0), self._scalar("pc", "map_pc", 0.0)
        if sheen != 0:
            found["sheen"] = sheen
        if coat != 0:
            found |= {"clearcoat": coat, "clearcoat_roughness": self._scalar("pcr", "map_pcr", 0.0)}
        stretch = self._one("aniso", 0.0)
        if stretch and not self.owner.has_uvs:
            self.notes.add(
                self._place("aniso"), "anisotropy needs texture coordinates, which the mesh lacks; it is left out"
            )
        elif stretch:
            found["anisotropic"] = stretch
            turns = self.material.number("anisor", 0.0)
            if turns % 1:
                found["anisotropic_rotation"] = 360 * (turns % 1)
        return found

    def _emission(self) -> dict[str, Any]:
        values = self.material.color("ke", 0.0)
        if min(values) < 0 or max(values) > BRIGHTEST:
            self.notes.add(
                self._place("ke"), "an emission (Ke) below 0 or above 1e20 is not supported; it is clamped"
            )
            values = tuple(min(max(value, 0.0), BRIGHTEST) for value in values)
        texture = self._texture("map_ke")
        if texture is not None:
            return {"emission": {"texture": texture, "factor": _plain(values) if max(values) else 1.0}}
        return {"emission": _plain(values)} if max(values) else {}

    def _relief(self) -> dict[str, Any]:
        """Normals and heights. The image under bump may be of either."""
        normals, bump, disp = self._map("norm"), self._map("map_bump"), self._map("disp")
        bump, disp = (each if each is not None and self.owner.textures.holds(each) else None for each in (bump, disp))
        if bump is not None and self.owner.textures.is_normal_map(bump):
            if normals is None:
                self.notes.add(bump.place, "the image under bump holds normals and is used as a normal map")
                normals = bump
            bump = None
        if bump is not None and disp is not None:
            self.notes.add(disp.place, "the heights under bump are used, and not these")
        found = self._normal(normals)
        return found | self._height(bump or disp, bool(found))

    def _height(self, found: Map | None, has_normals: bool) -> dict[str, Any]:
        texture = None if found is None else self.owner.textures.use(found)
        if found is None or texture is None:
            return {}
        if "-bm" in found.options:
            scale = _number(found.options["-bm"])
            assumed = f"-bm {scale:g} is taken for the metres from black to white"
        else:
            scale = self.owner.relief
            assumed = f"without -bm, {scale:g} m from black to white are assumed: 1 % of the model's size"
        shown = "; the normal map shows them, unless a shape has displacement" if has_normals else ""
        self.notes.add(found.place, f"the image holds heights; {assumed}{shown}")
        height = {"texture": texture, "channel": self.owner.textures.channel(found, "r"), "scale": scale}
        return {"height": height | ({"shading": False} if has_normals else {})}

    def _normal(self, found: Map | None) -> dict[str, Any]:
        texture = None if found is None else self.owner.textures.use(found)
        if found is None or texture is None:
            return {}
        scale = _number(found.options.get("-bm", ("1",)))
        if scale < 0:
            self.notes.add(found.place, "a negative scale (-bm) is not supported; the normal map is left out")
            return {}
        return {"normal_map": {"texture": texture} | ({"scale": scale} if scale != 1 else {})}

    def _opacity(self) -> float:
        if "d" in self.material.numbers or "tr" not in self.material.numbers:
            return self._one("d", 1.0)
        return 1 - self._one("tr", 0.0)

    def _alpha(self, opacity: float) -> dict[str, Any]:
        found = self._map("map_d")
        texture = None if found is None else self.owner.textures.use(found)
        if found is not None and texture is not None:
            channel = self.owner.textures.channel(found, "a")
            return {"alpha": {"texture": texture, "channel": channel, "factor": opacity or 1.0}}
        return {"alpha": opacity} if opacity < 1 else {}

    def _color(self, keyword: str, mapped: str, default: float) -> Any:
        """A colour within 0..1, or the texture that it multiplies; black, which would hide the texture, counts as
        1."""
        texture = self._texture(mapped)
        values = self._fraction(keyword, default if texture is None else 1.0)
        if texture is None:
            return _plain(values)
        return {"texture": texture, "factor": _plain(values) if max(values) else 1.0}

    def _scalar(self, keyword: str, mapped: str, default: float) -> Any:
        found, texture = self._map(mapped), self._texture(mapped)
        value = self._one(keyword, default if texture is None else 1.0)
        if found is None or texture is None:
            return value
        return {"texture": texture, "channel": self.owner.textures.channel(found, "r"), "factor": value or 1.0}

    def _one(self, keyword: str, default: float) -> float:
        return self._within(keyword, (self.material.number(keyword, default),))[0]

    def _fraction(self, keyword: str, default: float) -> tuple[float, ...]:
        return self._within(keyword, self.material.color(keyword, default))

    def _within(self, keyword: str, values: tuple[float, ...]) -> tuple[float, ...]:
        if min(values) < 0 or max(values) > 1:
            self.notes.add(self._place(keyword), f"{keyword} outside 0..1 is not supported; it is clamped")
        return tuple(min(max(value, 0.0), 1.0) for value in values)

    def _map(self, keyword: str) -> Map | None:
        """A map that the mesh can show."""
        found = self.material.maps.get(keyword)
        if found is not None and not self.owner.has_uvs:
            self.notes.add(found.place, "the mesh has no texture coordinates; it is shown without its textures")
            return None
        return found

    def _texture(self, keyword: str) -> str | None:
        found = self._map(keyword)
        return None if found is None else self.owner.textures.use(found)

    def _place(self, keyword: str) -> str:
        return self.material.places.get(keyword, self.material.place)


def _plain(values: tuple[float, ...]) -> Any:
    """A colour as a document writes it: one number where all are the same."""
    return values[0] if len(set(values)) == 1 else list(values)


def _number(words: tuple[str, ...]) -> float:
    try:
        return min(max(float(words[0]), -1e6), 1e6)
    except (ValueError, IndexError):
        return 1.0
