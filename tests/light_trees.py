"""The tree that lights are picked by, read back from its words, and asked on the device."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from gpu import Renderer, SceneArrays, layout
from gpu.device.textures import linear_texture
from gpu.kernels.flag_table import FLAGS
from gpu.layout import LightCluster, LightKind, LightNode, LightTreeHead, bindings
from gpu.layout.bindings import Slot
from tests.probing import prober_of


@dataclass
class Nodes:
    """What the records say, in world coordinates; row k of each is node k, nodes 2 and 3 the first pair."""

    center: np.ndarray
    radius: np.ndarray
    axis: np.ndarray
    cone: np.ndarray  # radians: half the angle of the normals' cone
    beyond: np.ndarray  # radians
    intensity: np.ndarray  # of the brightest light's
    link: np.ndarray


def head_of(words: np.ndarray) -> np.void:
    head: np.void = np.ascontiguousarray(words[:2]).reshape(-1).view(LightTreeHead.dtype)[0]
    return head


def nodes_of(words: np.ndarray) -> Nodes:
    head = head_of(words)
    n: Any = np.ascontiguousarray(words[: 2 * head["far_first"]]).reshape(-1).view(LightNode.dtype)
    step = 1 / float(head["inverse_step"])
    grid = np.stack([n["place"] & 0xFFFF, n["place"] >> 16, n["reach"] & 0xFFFF], 1)
    radius = (((n["reach"] >> 16 & 0xFF) << 20) + np.uint32(123 << 23)).view(np.float32) * step
    e = np.stack([n["shine"] & 0xFF, n["shine"] >> 8 & 0xFF], 1) / 127 - 1
    z = 1 - np.abs(e).sum(1)
    xy = e - np.maximum(-z, 0)[:, None] * np.where(e >= 0, 1, -1)
    axis = np.concatenate([xy, z[:, None]], 1)
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    return Nodes(
        grid * step + head["origin"].astype(float),
        radius,
        axis,
        2 * np.arcsin((n["reach"] >> 24) / 255),
        2 * np.arcsin((n["shine"] >> 16 & 31) / 31 / np.sqrt(2)),
        (((n["shine"] >> 21) << 19) + np.uint32(40 << 23)).view(np.float32),
        n["link"],
    )


def clusters_of(words: np.ndarray) -> list[np.ndarray]:
    """Of each cluster: the lights in its table."""
    n = int(head_of(words)["far_first"])
    clusters = np.ascontiguousarray(words[2 * n : 3 * n]).reshape(-1).view(LightCluster.dtype)
    return [words[int(c["first"]) :][: int(c["count"]), 0].astype(int) for c in clusters if c["count"]]


def ways(arrays: SceneArrays) -> list[list[int]]:
    """Of each light in the tree: the nodes that its trail leads through, the last of which is its own."""
    links = nodes_of(arrays.light_tree).link
    out = []
    for i, trail in enumerate(arrays.lights["alias"][: int(head_of(arrays.light_tree)["far_first"])].tolist()):
        way, pair = list[int](), 1
        while not way or not int(links[way[-1]]) & layout.LEAF_BIT:
            way.append(2 * pair + (trail >> len(way) & 1))
            pair = int(links[way[-1]]) & ~layout.CLUSTER_BIT
        assert int(links[way[-1]]) == layout.LEAF_BIT | i
        out.append(way)
    return out


class Picker:
    """Asks the shaders how the lights of a scene are picked."""

    def __init__(self, gpu: Renderer, arrays: SceneArrays) -> None:
        self._prober, self._lights = prober_of(gpu), arrays.lights.copy()
        self._lights["index"] = np.arange(len(self._lights))
        self._texture = linear_texture(self._prober.context, arrays.light_tree, 4, "u4")

    def _run(self, sample: int, count: int, asks: np.ndarray, p: Any, n: Any, through: bool) -> np.ndarray:
        self._texture.use(bindings.LIGHT_TREE_TEXTURE)
        frame = np.zeros((), layout.Uniforms.dtype)
        frame["light_count"] = len(self._lights)
        kinds = {f"HAS_{LightKind(int(kind)).name}_LIGHTS" for kind in set(self._lights["kind"])} & set(FLAGS)
        flags = kinds | {"HAS_LIGHTS", "HAS_MANY_LIGHTS", "HAS_LIGHT_TREE", "HAS_TRANSMISSION", "HAS_PRINCIPLED"}
        inputs = {Slot.SUM: asks, Slot.LIGHTS: self._lights}
        return self._prober.run(
            "light_tree.comp", count, inputs, (Slot.OUTPUT,), {"SAMPLE": sample}, frozenset(flags), frame,
            p=tuple(map(float, p)), n=tuple(map(float, n)), through=int(through),
        )[0].astype(float)  # fmt: skip

    def drawn(self, bits: np.ndarray, p: Any, n: Any, through: bool = False) -> tuple[np.ndarray, np.ndarray]:
        """Of numbers (k,) uint32: which lights, and with what chances they say."""
        asks = np.zeros((len(bits), 4), np.uint32)
        asks[:, 0] = bits
        out = self._run(1, len(bits), asks, p, n, through)
        return out[:, 0].astype(int), out[:, 1]

    def chances(self, p: Any, n: Any, through: bool = False) -> tuple[np.ndarray, np.ndarray]:
        """Of each light: its chance, and the least importance on the way to it."""
        out = self._run(0, len(self._lights), np.zeros((1, 4), np.uint32), p, n, through)
        assert np.array_equal(out[:, 0], np.arange(len(out)))
        return out[:, 1], out[:, 2]

    def close(self) -> None:
        self._texture.release()
