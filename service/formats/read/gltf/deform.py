"""Morph targets with the nodes' weights, and skins in the pose of their joints."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from service.formats.read.gltf import accessors
from service.formats.read.gltf.document import Array, GltfDocument
from service.formats.read.gltf.json_view import JsonView, number
from service.formats.read.gltf.nodes import Nodes
from service.formats.read.gltf.primitives import Primitive, cofactors
from service.formats.types import Doubles


def weights(node: JsonView, mesh: JsonView) -> tuple[float, ...]:
    """The weights of the mesh's morph targets: the node's, or else the mesh's; () where none has an effect."""
    owner = node if "weights" in node else mesh
    found = tuple(number(one, f"{owner.at('weights')}/{k}") for k, one in enumerate(owner.array("weights")))
    return found if any(found) else ()


def morphed(file: GltfDocument, primitive: Primitive, place: JsonView, weights: tuple[float, ...]) -> Primitive:
    """The primitive with its targets added, each by its weight."""
    vertices: Array = primitive.vertices.astype(np.float64)
    moved: dict[str, Array] = {"POSITION": vertices}
    if primitive.normals is not None:
        moved["NORMAL"] = primitive.normals
    if primitive.tangents is not None:
        moved["TANGENT"] = primitive.tangents[:, :3]
    for target, weight in zip(place.objects("targets"), weights, strict=False):
        for name, rows in moved.items():
            if not weight or name not in target:
                continue
            offsets = accessors.read(file, target, name, "VEC3")
            if primitive.numbers is not None:
                if primitive.numbers[-1] >= len(offsets):
                    raise target.error(name, f"has {len(offsets)} items, fewer than there are vertices")
                offsets = offsets[primitive.numbers]
            if len(offsets) != len(rows):
                raise target.error(name, f"has {len(offsets)} items for {len(rows)} vertices")
            moved[name] = rows + weight * offsets.astype(np.float64)
    tangents = primitive.tangents
    if tangents is not None:
        tangents = np.concatenate([moved["TANGENT"], tangents[:, 3:]], axis=1)
    return replace(primitive, vertices=moved["POSITION"], normals=moved.get("NORMAL"), tangents=tangents)


class Skin:
    """The joints' matrices, from the mesh's bind pose to world space."""

    def __init__(self, file: GltfDocument, place: JsonView, nodes: Nodes) -> None:
        self.place = place
        joints = place.array("joints")
        if not joints:
            raise place.error("joints", "must name at least one node")
        worlds = [nodes.world(joint, f"{place.at('joints')}/{k}") for k, joint in enumerate(joints)]
        self.matrices: Doubles = np.stack(worlds)
        if "inverseBindMatrices" in place:
            bound = accessors.read(file, place, "inverseBindMatrices", "MAT4").astype(np.float64)
            if len(bound) < len(joints):
                raise place.error("inverseBindMatrices", f"has {len(bound)} items for {len(joints)} joints")
            self.matrices = self.matrices @ bound[: len(joints)].reshape(-1, 4, 4).transpose(0, 2, 1)

    def posed(self, primitive: Primitive, place: JsonView) -> Primitive:
        """The primitive in world space. Raises ParseError where it names joints that do not exist."""
        if not primitive.joints:
            raise place.error("attributes", f"have no JOINTS_0 and WEIGHTS_0, which {self.place.pointer} needs")
        total = sum(w.sum(axis=1, dtype=np.float64) for w in primitive.weights)
        vertices, normals = primitive.vertices.astype(np.float64), primitive.normals
        turned = cofactors(self.matrices[:, :3, :3])
        posed, faced, along = np.zeros_like(vertices), np.zeros_like(vertices), np.zeros_like(vertices)
        for joints, shares in zip(primitive.joints, primitive.weights, strict=True):
            for k in range(4):
                joint, share = joints[:, k].astype(np.int64), shares[:, k].astype(np.float64)
                if joint.max() >= len(self.matrices) or joint.min() < 0:
                    raise place.error("attributes", f"name joint {joint.max()} of {len(self.matrices)}")
                share = np.divide(share, total, out=np.zeros_like(share), where=total > 0)[:, None]
                matrix = self.matrices[joint]
                posed += share * (np.einsum("nij,nj->ni", matrix[:, :3, :3], vertices) + matrix[:, :3, 3])
                if normals is not None:
                    faced += share * np.einsum("nij,nj->ni", turned[joint], normals)
                if primitive.tangents is not None:
                    along += share * np.einsum("nij,nj->ni", matrix[:, :3, :3], primitive.tangents[:, :3])
        mirrored = bool((np.linalg.det(self.matrices[:, :3, :3]) < 0).all())
        if mirrored:
            faced, faces = -faced, primitive.faces[:, ::-1]
        else:
            faces = primitive.faces
        tangents = primitive.tangents
        if tangents is not None:
            tangents = np.concatenate([along, tangents[:, 3:] * (-1 if mirrored else 1)], axis=1)
        return replace(primitive, vertices=posed, faces=faces, normals=None if normals is None else faced,
                       tangents=tangents, joints=(), weights=())  # fmt: skip
