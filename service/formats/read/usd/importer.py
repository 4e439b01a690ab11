"""A USD file as a scene document, and the meshes and images that it refers to; or all its triangles as one mesh."""

from __future__ import annotations

from typing import Any

import numpy as np
from pxr import Gf, Usd, UsdGeom, UsdLux, UsdShade, UsdSkel

from service.formats.errors import ParseError
from service.formats.read.archive import Archive
from service.formats.read.raw_mesh import MAX_COORDINATE, RawMesh
from service.formats.read.scenes import metering
from service.formats.read.scenes.framing import framed
from service.formats.read.scenes.part_files import PartFiles
from service.formats.read.scenes.placements import Part, Placements
from service.formats.read.scenes.ply_writer import ply
from service.formats.read.scenes.room import stand_inside
from service.formats.read.scenes.warnings import Warnings
from service.formats.read.scenes.wrapping import goes_beyond
from service.formats.read.usd import cameras
from service.formats.read.usd.lights import Lamp, Lights
from service.formats.read.usd.materials import Bound, Materials
from service.formats.read.usd.meshes import COLOR, OPACITY, Mesh, Piece
from service.formats.read.usd.package import Package, opened
from service.formats.read.usd.solids import Solid, is_solid, solid
from service.formats.read.usd.textures import Textures
from service.formats.read.usd.walk import Item, Walk, metres_per_unit, up_axis
from service.formats.types import AssetLimits, SceneFile


def read_scene(data: bytes | memoryview, limits: AssetLimits) -> SceneFile:
    """The scene of a USD file. Raises ParseError."""
    notes = Warnings()
    return _Importer(opened(data, limits, notes), limits, notes).run()


def read_zipped_scene(archive: Archive, path: str, limits: AssetLimits) -> SceneFile:
    """The scene of the layer at this path of a zip. Raises ParseError."""
    notes = Warnings()
    return _Importer(Package(b"", notes, archive, path), limits, notes).run()


def read_merged(data: bytes | memoryview, limits: AssetLimits) -> RawMesh:
    """All triangles of a USD file where they stand, as one mesh. Raises ParseError."""
    notes = Warnings()
    return _Importer(opened(data, limits, notes), limits, notes).merged()


def read_zipped_merged(archive: Archive, path: str, limits: AssetLimits) -> RawMesh:
    """The triangles of the layer at this path of a zip, likewise. Raises ParseError."""
    notes = Warnings()
    return _Importer(Package(b"", notes, archive, path), limits, notes).merged()


class _Importer:
    def __init__(self, package: Package, limits: AssetLimits, notes: Warnings) -> None:
        self.limits, self.notes, self.files = limits, notes, PartFiles()
        self.stage = package.stage()
        self.unit = metres_per_unit(self.stage)
        if not 1e-9 <= self.unit <= 1e9:
            raise ParseError(f"metersPerUnit must be from 1e-9 to 1e9, not {self.unit:g}", "metersPerUnit")
        self.time = self._shown_time()
        self._pose()
        if up_axis(self.stage) not in ("Y", "Z"):
            self.notes.add("upAxis", "an axis that is up other than Y and Z is not supported; Y is used instead")
        self.walk = Walk(self.stage, self.time, self.notes)
        self.items = self.walk.items()
        self.textures = Textures(package, self.files, limits, self.notes)
        self.materials = Materials(self.textures, self.time, self.unit, self.notes)
        self.placements = Placements()
        self.lights = Lights(
            self.time, self.unit, self.textures, self.files, self.materials.documents, self.notes
        )  # fmt: skip
        self._triangles = 0
        self._meshes: dict[str, Mesh] = {}
        self._parts: dict[tuple[str, ...], list[tuple[Part, str]]] = {}
        self._pieces: list[tuple[Piece, Item]] = []

    def run(self) -> SceneFile:
        for item in self.items:
            self._add(item)
        if not self._has_surface():
            raise self._nothing_left()
        # The lamps come last, and what frames the scene does not see them.
        around = self.placements.bounds
        shapes, placed = self.placements.shapes(self.notes), self.placements.placed()
        lamps, lights = self.lights.lamps, self.lights.lights
        seen = [item for item in self.items if item.prim.IsA(UsdGeom.Camera)]
        found, aspect = cameras.camera(seen, self.time, self.unit, around, self.notes)
        document: dict[str, Any] = {
            "version": 1,
            "camera": found or framed(around),
            "environment": self.lights.environment,
            "lights": lights,
            "textures": self.materials.shown,
            "materials": self.materials.documents,
            "shapes": shapes + [lamp.shape for lamp in lamps],
        }
        used = {name: value for name, value in document.items() if value or name in ("materials", "shapes")}
        lighting = Warnings()
        is_lit = bool(lights or lamps or self.lights.environment)
        if not is_lit:
            remark = stand_inside(used, placed, around, has_camera=found is not None)
            if remark is not None:
                lighting.add("", remark)
            is_lit = bool(used.get("lights"))
        exposure = self._metered(used, placed, aspect, lighting) if lights or lamps else None
        triangles = sum(part.triangles for part in self.placements.shown)
        bounds = [corner.tolist() for corner in around]
        warnings = [*lighting.document(), *self.notes.document()]  # warnings about the whole picture come first
        return SceneFile(used, self.files.parts, warnings, triangles, is_lit, exposure, aspect, bounds)

    def merged(self) -> RawMesh:
        for item in self.items:
            if item.prim.IsA(UsdGeom.Mesh):
                self._pieces.append((self._mesh(item).piece(None, ["st"], True), item))
            elif is_solid(item.prim):
                body = solid(item.prim, self.time)
                if body is not None:
                    self._pieces.append((Piece(body.vertices, body.faces, body.normals, [None], None), item))
        count = sum(len(piece.faces) * len(item.worlds) for piece, item in self._pieces)
        if count > self.limits.max_triangles:
            raise ParseError(f"the scene has more than the {self.limits.max_triangles} triangles allowed")
        if not count:
            raise self._nothing_left()
        vertices, faces, uvs, at = [], [], [], 0
        for piece, item in self._pieces:
            for world in item.worlds:
                turned = piece.faces[:, ::-1] if np.linalg.det(world[:3, :3]) < 0 else piece.faces
                vertices.append(piece.vertices @ world[:3, :3].T + world[:3, 3])
                faces.append(turned.astype(np.int64) + at)
                chart = piece.uvs[0]
                uvs.append(np.zeros((len(piece.vertices), 2)) if chart is None else chart)
                at += len(piece.vertices)
        warnings = [f"{note['pointer']}: {note['detail']}" for note in self.notes.document()]
        return RawMesh(np.concatenate(vertices), np.concatenate(faces), None, np.concatenate(uvs), warnings=warnings)

    def _add(self, item: Item) -> None:
        prim = item.prim
        if prim.IsA(UsdGeom.Mesh):
            for part, name in self._mesh_parts(item):
                self.placements.add(part, item.pointer, item.worlds, name)
            if prim.HasAPI(UsdLux.MeshLightAPI):
                self.notes.add(item.pointer, "a mesh that is a light is not supported; it glows by its material only")
        elif is_solid(prim):
            self._solid(item)
        elif prim.HasAPI(UsdLux.LightAPI):
            self.lights.add(item)
        elif prim.IsA(UsdGeom.Gprim):
            self.notes.leave_out(item.pointer, f"{prim.GetTypeName()} is not supported and is left out")

    def _mesh(self, item: Item) -> Mesh:
        prim = item.prim
        key = str((prim.GetPrimInPrototype() if prim.IsInstanceProxy() else prim).GetPath())
        if key not in self._meshes:
            self._meshes[key] = Mesh(prim, self.time, self.notes)
        return self._meshes[key]

    def _mesh_parts(self, item: Item) -> list[tuple[Part, str]]:
        """The parts of a mesh, one for each material, and the name of each."""
        mesh = self._mesh(item)
        if not len(mesh.triangles):
            self.notes.leave_out(item.pointer, "the mesh has no faces and is left out")
            return []
        groups: list[tuple[Any, UsdShade.Material | None]] = []
        rest = np.ones(len(mesh.triangles), bool)
        for subset in UsdShade.MaterialBindingAPI(item.prim).GetMaterialBindSubsets():
            chosen = np.zeros(mesh.face_count, bool)
            numbers = np.array(subset.GetIndicesAttr().Get(self.time) or [], np.int64)
            if subset.GetElementTypeAttr().Get(self.time) != UsdGeom.Tokens.face:
                self.notes.add(str(subset.GetPath()), "a material of a subset that is not of faces is left out")
                continue
            wrong = (numbers < 0) | (numbers >= mesh.face_count)
            if wrong.any():
                detail = f"names face {numbers[wrong][0]}; there are {mesh.face_count}; it is left out"
                self.notes.add(str(subset.GetPath()), detail)
            chosen[numbers[~wrong]] = True
            which = rest & chosen[mesh.face_of]
            rest &= ~which
            groups.append((np.flatnonzero(which), self.materials.of(subset.GetPrim())))
        whole = None if not groups else np.flatnonzero(rest)
        groups.append((whole, self.materials.of(item.prim)))
        key = mesh.pointer, *(self.materials.key(material) for _, material in groups)
        if key not in self._parts:
            self._parts[key] = []
            for which, material in groups:
                if which is None or len(which):
                    part = self._part(mesh, which, material)
                    self._parts[key].append((part, part.shape["material"]))
        found = self._parts[key]
        return [(part, f"{item.name}/{name}"[:480] if len(found) > 1 else item.name) for part, name in found]

    def _part(self, mesh: Mesh, which: Any, material: UsdShade.Material | None) -> Part:
        bound = self._bound(material, mesh)
        piece = mesh.piece(which, list(bound.charts), bound.is_colored)
        self._count(len(piece.faces))
        for chart in bound.charts:
            if not mesh.has(chart):
                detail = f"it has no coordinates {chart[:40]!r}, which its material reads; 0 0 is used everywhere"
                self.notes.add(mesh.pointer, detail)
        for edge in bound.edges:
            uvs = piece.uvs[bound.charts.index(edge.chart)]
            if uvs is not None and len(uvs) and goes_beyond(uvs, edge.placing)[edge.axis]:
                self.notes.add(edge.pointer, edge.detail)
        shape: dict[str, Any] = {"type": "mesh", "asset": self._stored(piece, mesh.pointer), "material": bound.name}
        if piece.normals is None:
            shape["smooth"] = False
        return Part(shape, piece.vertices, piece.faces)

    def _bound(self, material: UsdShade.Material | None, mesh: Mesh | None) -> Bound:
        found = self.materials.use(material) if material is not None else None
        if found is not None:
            return found
        color = mesh.constant_color() if mesh is not None else None
        return self.materials.plain(color, mesh is not None and color is None and mesh.has_color())

    def _solid(self, item: Item) -> None:
        body: Solid | None = solid(item.prim, self.time)
        if body is None:
            self.notes.leave_out(item.pointer, "a body without an extent is left out")
            return
        material = self.materials.of(item.prim)
        found = self.materials.use(material) if material is not None else None
        color, opacity = (_display(item, name, self.time) for name in (COLOR, OPACITY))
        bound = found or self.materials.plain(color, False, opacity[0] if opacity else 1.0)
        if bound.charts:
            self.notes.add(item.pointer, "a body without texture coordinates in the file has its own here")
        if body.shape is not None:
            shape = {**body.shape, "material": bound.name}
        else:
            piece = Piece(body.vertices, body.faces, body.normals, [], None)
            self._count(len(piece.faces))
            self.notes.add(item.pointer, f"a {item.prim.GetTypeName()} is shown as triangles")
            shape = {"type": "mesh", "asset": self._stored(piece, item.pointer), "material": bound.name}
        self.placements.add(Part(shape, body.vertices, body.faces), item.pointer, item.worlds, item.name)

    def _stored(self, piece: Piece, pointer: str) -> str:
        bad = np.flatnonzero(~(np.abs(piece.vertices) <= MAX_COORDINATE).all(axis=1))  # true for NaN, too
        if len(bad):
            raise ParseError(f"a point is not finite or lies beyond 1e9: {piece.vertices[bad[0]].tolist()}", pointer)
        data = ply(piece.vertices, piece.faces, piece.normals, piece.uvs, piece.colors)
        return self.files.add_mesh(data, pointer, piece.vertices, len(piece.faces))

    def _count(self, triangles: int) -> None:
        self._triangles += triangles
        if self._triangles > self.limits.max_triangles:
            raise ParseError(f"the scene has more than the {self.limits.max_triangles} triangles allowed")

    def _has_surface(self) -> bool:
        return bool(self.placements.shown)

    def _nothing_left(self) -> ParseError:
        self.placements.shapes(self.notes)  # tells what is flat
        if self.walk.hidden is not None:
            self.notes.leave_out(*self.walk.hidden)
        return self.notes.nothing_left()

    def _metered(self, document: dict[str, Any], placed: Any, aspect: float | None, notes: Warnings) -> float | None:
        """The exposure that suits the file's lights, where 0 does not; lamps count as points."""
        points = [_point(lamp) for lamp in self.lights.lamps]
        shown = {**document, "lights": [*self.lights.lights, *points]}
        stops = metering.exposure(shown, placed, aspect)
        if stops is not None:
            side = "above" if stops < 0 else "below"
            exposed = f"the file's lights expose the picture {abs(stops):g} stops {side} middle grey"
            notes.add("", f"{exposed}; they are kept as they are, and an exposure of {stops:g} suits them")
        return stops

    def _shown_time(self) -> Usd.TimeCode:
        """The first frame of what moves; where the file says nothing of frames, each value's own or its first one."""
        if not self.stage.HasAuthoredTimeCodeRange():
            return Usd.TimeCode.EarliestTime()
        start = self.stage.GetStartTimeCode()
        if self.stage.GetEndTimeCode() > start:
            self.notes.add("", f"animation is not played; the scene is shown at time code {start:g}")
        return Usd.TimeCode(start)

    def _pose(self) -> None:
        """Move the points of skinned meshes to where their skeletons put them, in a layer of this process."""
        roots = [prim for prim in self.stage.Traverse() if prim.IsA(UsdSkel.Root)]
        if not roots:
            return
        moving = [prim for prim in self.stage.Traverse() if prim.IsA(UsdSkel.Animation)]
        values = [value for prim in moving for value in prim.GetAuthoredAttributes()]
        keys = sorted({key for value in values for key in value.GetTimeSamples()})
        at = Gf.Interval.GetFullInterval()
        if keys:  # skins are computed at keys only: the first one that is shown, or the last of all
            start = self.time.GetValue() if self.time.IsNumeric() else keys[0]
            shown = next((key for key in keys if key >= start), keys[-1])
            self.time, at = Usd.TimeCode(shown), Gf.Interval(shown, shown)
        self.stage.SetEditTarget(self.stage.GetSessionLayer())
        for prim in roots:
            if not UsdSkel.BakeSkinning(UsdSkel.Root(prim), at):
                pointer = str(prim.GetPath())
                self.notes.add(pointer, "its skeleton is broken; skinned meshes are shown as they were modelled")


def _display(item: Item, name: str, time: Usd.TimeCode) -> list[float] | None:
    """The first value of a body's displayColor or displayOpacity."""
    width = 3 if name == COLOR else 1
    primvar = UsdGeom.PrimvarsAPI(item.prim).FindPrimvarWithInheritance(name)
    values = np.array(primvar.Get(time) if primvar else [])
    if values.dtype.kind not in "fiu" or values.size < width:
        return None
    return [min(max(float(value), 0.0), 1.0) for value in values.reshape(-1)[:width]]


def _point(lamp: Lamp) -> dict[str, Any]:
    if lamp.shape["type"] == "sphere":
        return {"type": "point", "position": lamp.world[:3, 3].tolist(), "intensity": lamp.intensity}
    direction = (-lamp.world[:3, 2]).tolist()
    return {
        "type": "spot", "position": lamp.world[:3, 3].tolist(), "direction": direction, "intensity": lamp.intensity,
        "inner_angle": 0.0, "outer_angle": 90.0,
    }  # fmt: skip
