"""UsdLux -> lights, glowing shapes and the environment.

A nit counts as a watt per steradian and square metre, as a candela does as a watt per steradian in glTF. The
brightness of a light is intensity 2^exposure colour, in nits; normalised, it is divided by the light's size, whose
area is in the stage's units [OpenUSD, "UsdLux Overview"].
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from pxr import Usd, UsdLux

from service.colorimetry import LUMINANCE
from service.formats.read.scenes.names import unique
from service.formats.read.scenes.part_files import PartFiles
from service.formats.read.scenes.warnings import Warnings
from service.formats.read.usd.networks import linear, plain
from service.formats.read.usd.textures import Textures
from service.formats.read.usd.walk import Item, up_axis
from service.formats.types import Doubles

BRIGHTEST = 1e20
BLACK = {"type": "diffuse", "albedo": 0.0}
SPOT = 89.9  # degrees of a cone from which on it does not count as a spot's


@dataclass(frozen=True)
class Lamp:
    """A shape that emits. `at` and `power` are for metering: where, towards what, and its radiant intensity."""

    shape: dict[str, Any]
    world: Doubles
    name: str
    pointer: str
    intensity: list[float]


@dataclass
class Lights:
    """The lights of a file, as they are found."""

    time: Usd.TimeCode
    unit: float  # metres per unit of the stage
    textures: Textures
    files: PartFiles
    materials: dict[str, dict[str, Any]]
    notes: Warnings
    lights: list[dict[str, Any]] = field(default_factory=list)
    lamps: list[Lamp] = field(default_factory=list)
    environment: dict[str, Any] | None = None

    def add(self, item: Item) -> None:
        prim = item.prim
        kinds = {
            UsdLux.DistantLight: self._distant, UsdLux.RectLight: self._rectangle, UsdLux.DiskLight: self._disk,
            UsdLux.CylinderLight: self._tube, UsdLux.SphereLight: self._ball,
        }  # fmt: skip
        if prim.IsA(UsdLux.DomeLight) or prim.IsA(UsdLux.DomeLight_1):
            self._dome(item)
            return
        make = next((made for kind, made in kinds.items() if prim.IsA(kind)), None)
        if make is None:
            self.notes.add(item.pointer, f"a {prim.GetTypeName()} is not supported and is left out")
            return
        self._note_refinements(item)
        brightness = self._brightness(prim)
        if not brightness.any():
            return
        for world in item.worlds:
            make(item, world, brightness)

    def _distant(self, item: Item, world: Doubles, brightness: Doubles) -> None:
        angle = self._number(item.prim, "angle", 0.53)
        half = math.radians(min(max(angle, 0.0), 180.0) / 2)
        share = math.pi * math.sin(half) ** 2
        is_illuminance = self._flag(item.prim, "normalize") or not share
        if angle > 90:
            self.notes.add(item.pointer, "an angle above 90 degrees is not supported; 90 is used instead")
        self.lights.append({
            "type": "directional", "direction": _axis(world, 2, -1), "name": item.name,
            "irradiance": _limited(brightness if is_illuminance else brightness * share),
            **({"angular_diameter": min(angle, 90.0)} if angle > 0 else {}),
        })  # fmt: skip

    def _rectangle(self, item: Item, world: Doubles, brightness: Doubles) -> None:
        width, height = self._number(item.prim, "width", 1.0), self._number(item.prim, "height", 1.0)
        if plain(self._value(item.prim, "texture:file"), ""):
            self.notes.add(item.pointer, "the texture of a rectangular light is not supported; it glows evenly")
        u, v = world[:3, 0] * width, world[:3, 1] * height
        # It shines along -z: cross(u, v) must point there, so u runs the other way.
        origin = world[:3, 3] + (u - v) / 2
        if np.linalg.det(world[:3, :3]) < 0:
            u, origin = -u, origin - u
        shape = {"type": "quad", "origin": origin.tolist(), "u": (-u).tolist(), "v": v.tolist()}
        self._lamp(item, shape, float(np.linalg.norm(np.cross(u, v))), brightness, world, 1.0)

    def _disk(self, item: Item, world: Doubles, brightness: Doubles) -> None:
        radius = self._number(item.prim, "radius", 0.5)
        scale = _scale(world, item, self.notes)
        normal = _axis(world, 2, -1)
        shape = {"type": "disk", "center": world[:3, 3].tolist(), "normal": normal, "radius": radius * scale}
        self._lamp(item, shape, math.pi * (radius * scale) ** 2, brightness, world, 1.0)

    def _tube(self, item: Item, world: Doubles, brightness: Doubles) -> None:
        """Its side shines, and its ends are open."""
        length, radius = self._number(item.prim, "length", 1.0), self._number(item.prim, "radius", 0.5)
        if not (length > 0 and radius > 0):
            self.notes.add(item.pointer, "a light without an area is left out")
            return
        scale = _scale(world, item, self.notes)
        axis = world[:3, 0] * length
        shape = {
            "type": "cylinder", "base": (world[:3, 3] - axis / 2).tolist(), "axis": axis.tolist(),
            "radius": radius * scale, "caps": False,
        }  # fmt: skip
        area = 2 * math.pi * radius * scale * float(np.linalg.norm(axis))
        # Across its axis its intensity is 2 r l L, of an area of 2 pi r l.
        self._lamp(item, shape, area, brightness, world, 1 / math.pi)

    def _ball(self, item: Item, world: Doubles, brightness: Doubles) -> None:
        prim = item.prim
        radius = self._number(prim, "radius", 0.5) * _scale(world, item, self.notes)
        cone = self._number(prim, "shaping:cone:angle", 90.0) if prim.HasAPI(UsdLux.ShapingAPI) else 90.0
        is_spot = cone < SPOT
        if radius > 0 and not is_spot and not prim.GetAttribute("treatAsPoint").Get(self.time):
            shape = {"type": "sphere", "center": world[:3, 3].tolist(), "radius": radius}
            self._lamp(item, shape, 4 * math.pi * radius**2, brightness, world, 0.25)
            return
        if not radius and not self._flag(prim, "normalize"):
            self.notes.add(item.pointer, "a light without an area is left out")
            return
        # Of a ball of radiance L: L pi r^2; normalised L is a quarter of the power over pi r^2, whatever the radius.
        share = self._unit_area(0.25) if self._flag(prim, "normalize") else math.pi * radius**2
        intensity = _limited(brightness * share)
        position = world[:3, 3].tolist()
        if not is_spot:
            self.lights.append({"type": "point", "position": position, "intensity": intensity, "name": item.name})
            return
        soft = min(max(self._number(prim, "shaping:cone:softness", 0.0), 0.0), 1.0)
        self.lights.append({
            "type": "spot", "position": position, "direction": _axis(world, 2, -1), "intensity": intensity,
            "inner_angle": cone * (1 - soft), "outer_angle": cone, "name": item.name,
        })  # fmt: skip
        if radius > 0:
            self.notes.add(item.pointer, "a light with a cone has no size here: its shadows are sharp")

    def _lamp(
        self, item: Item, shape: dict[str, Any], area: float, brightness: Doubles, world: Doubles, share: float
    ) -> None:
        """A shape of this area (m^2) whose radiance is the brightness. `share` of its area is seen from in front."""
        if not area > 0:
            self.notes.add(item.pointer, "a light without an area is left out")
            return
        prim = item.prim
        if prim.HasAPI(UsdLux.ShapingAPI) and self._number(prim, "shaping:cone:angle", 90.0) < SPOT:
            self.notes.add(
                item.pointer, "the cone of an area light is not supported; it shines to all sides in front"
            )
        radiance = brightness / (area / self.unit**2) if self._flag(prim, "normalize") else brightness
        name = self._material(item, _limited(radiance))
        shown = {**shape, "material": name, "name": item.name, "visible_to_camera": False}
        self.lamps.append(Lamp(shown, world, item.name, item.pointer, _limited(radiance * area * share)))

    def _material(self, item: Item, radiance: list[float]) -> str:
        document = {**BLACK, "emission": radiance}
        found = next((name for name, one in self.materials.items() if one == document), None)
        if found is None:
            found = unique(item.prim.GetName(), self.materials)
            self.materials[found] = document
        return found

    def _dome(self, item: Item) -> None:
        prim = item.prim
        brightness = self._brightness(prim)
        if self.environment is not None or len(item.worlds) != 1:
            self.notes.add(item.pointer, "a second dome light is not supported; the first is used")
            return
        self._note_refinements(item)
        path = str(plain(self._value(prim, "texture:file"), ""))
        data = self.textures.image(path, item.pointer) if path else None
        if data is None:
            self.environment = {"type": "constant", "radiance": _limited(brightness)}
            return
        form = str(self._value(prim, "texture:format") or "automatic")
        if form not in ("automatic", "latlong"):
            self.notes.add(item.pointer, f"a dome in the format {form[:40]} is not supported; it is read as latlong")
        scale = float(LUMINANCE @ brightness)
        if brightness.max() - brightness.min() > 1e-4 * max(scale, 1e-30):
            self.notes.add(
                item.pointer, "the colour of a dome with a texture is not supported; its luminance is used"
            )
        self.environment = {
            "type": "image", "asset": self.files.add(data, item.pointer), "scale": min(scale, BRIGHTEST),
            "rotation": self._turn(item),
        }  # fmt: skip

    def _turn(self, item: Item) -> float:
        """Degrees about the vertical. USD has +Z in the middle of the image and +X a quarter to its left, as in
        OpenEXR's latitude-longitude maps; the document has -Z there, half a turn away."""
        world = item.worlds[0][:3, :3]
        if item.prim.IsA(UsdLux.DomeLight_1):
            pole = str(item.prim.GetAttribute("poleAxis").Get(self.time) or "scene")
            if pole == "Z" or (pole == "scene" and up_axis(item.prim.GetStage()) == "Z"):
                # The pole lies along the stage's z: what was y turns there.
                world = world @ np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
        forward, pole_w = world[:, 2], world[:, 1]
        if pole_w[1] < 0.999 * float(np.linalg.norm(pole_w)):
            self.notes.add(
                item.pointer, "a dome that is tilted is not supported; it is turned about the vertical only"
            )
        angle = math.degrees(math.atan2(forward[0], forward[2])) + 180.0
        return round((angle + 180.0) % 360.0 - 180.0, 6) + 0.0

    def _brightness(self, prim: Usd.Prim) -> Doubles:
        default = 50000.0 if prim.IsA(UsdLux.DistantLight) else 1.0
        strength = self._number(prim, "intensity", default) * 2.0 ** min(self._number(prim, "exposure", 0.0), 1000.0)
        color = self._color(prim)
        if self._flag(prim, "enableColorTemperature"):
            warm = UsdLux.BlackbodyTemperatureAsRgb(self._number(prim, "colorTemperature", 6500.0))
            color = tuple(a * b for a, b in zip(color, plain(warm), strict=True))
        found = np.array(color, np.float64) * strength
        if not (np.isfinite(found).all() and (found >= 0).all()):
            self.notes.add(str(prim.GetPath()), "a light whose brightness is negative or not finite is left out")
            return np.zeros(3)
        return np.asarray(found)

    def _note_refinements(self, item: Item) -> None:
        for name, neutral, what in (
            ("diffuse", 1.0, "a light's share of diffuse reflection"), ("specular", 1.0, "a share of highlights"),
            ("shaping:focus", 0.0, "a light's focus"), ("shadow:enable", 1.0, "a light without shadows"),
        ):  # fmt: skip
            if self._number(item.prim, name, neutral) != neutral:
                self.notes.add(f"{item.pointer}.inputs:{name}", f"{what} is not supported; it is ignored")
        if plain(self._value(item.prim, "shaping:ies:file"), ""):
            self.notes.add(item.pointer, "an IES profile is not supported; the light shines evenly")
        if item.prim.GetRelationship("light:filters").GetTargets():
            self.notes.add(item.pointer, "light filters are not supported; they are ignored")
        for link in ("lightLink", "shadowLink"):
            if item.prim.GetRelationship(f"collection:{link}:includes").HasAuthoredTargets():
                self.notes.add(
                    item.pointer, "a light that shines on some things only is not supported; it does on all"
                )

    def _unit_area(self, share: float) -> float:
        return share * self.unit**2

    def _value(self, prim: Usd.Prim, name: str) -> Any:
        """An input by today's name, or by that of files before 2021."""
        for full in (f"inputs:{name}", name):
            found = prim.GetAttribute(full)
            if found and found.HasValue() and (full == name or found.HasAuthoredValue()):
                return found.Get(self.time)
        return None

    def _color(self, prim: Usd.Prim) -> tuple[float, ...]:
        """In linear Rec.709."""
        found = prim.GetAttribute("inputs:color")
        value = plain(self._value(prim, "color"), (1.0,) * 3)
        return tuple(linear(found, value)) if found else value

    def _number(self, prim: Usd.Prim, name: str, default: float) -> float:
        found = plain(self._value(prim, name), default)
        return float(found) if isinstance(found, int | float) and math.isfinite(found) else default

    def _flag(self, prim: Usd.Prim, name: str) -> bool:
        return bool(self._value(prim, name))


def _limited(values: Doubles) -> list[float]:
    return [min(float(value), BRIGHTEST) for value in values]


def _axis(world: Doubles, axis: int, sign: int) -> list[float]:
    """A direction of the prim in the world, of length one."""
    direction = sign * world[:3, axis]
    length = float(np.linalg.norm(direction))
    return [float(value) for value in (direction / length if length > 0 else sign * np.eye(3)[axis])]


def _scale(world: Doubles, item: Item, notes: Warnings) -> float:
    """The factor on a radius; the mean where the axes differ."""
    lengths = np.linalg.norm(world[:3, :3], axis=0)
    if np.ptp(lengths) > 1e-3 * lengths.max():
        notes.add(item.pointer, "a round light that is scaled unevenly is not supported; its mean radius is used")
    return float(np.cbrt(np.prod(lengths)))
