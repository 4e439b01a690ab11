"""The editor's pictures of presets are of these presets, in this light."""

from __future__ import annotations

import json
import math
from collections import Counter
from typing import Any

import numpy as np
import pytest

from service.document import presets
from service.document.presets import physically_based
from tests.bench import thumbnail_shapes as shapes
from tests.bench import thumbnail_stages as stages
from tests.bench import thumbnails

INDEX = json.loads((thumbnails.FOLDER / "index.json").read_text())
MOST_BYTES, MOST_OF_ALL = 8_000, 600_000  # of one picture, which tiles fetch as they are seen; of all in the wheel


def test_every_preset_has_a_picture_of_itself() -> None:
    """Else: `make thumbnails`."""
    assert thumbnails.wanted() == INDEX
    pictures = {thumbnails.picture(kind, name) for kind, all_of_it in INDEX.items() for name in all_of_it}
    page = thumbnails.FOLDER / "first"  # the picture that comes with the page is another matter
    assert {path for path in thumbnails.FOLDER.rglob("*.webp") if path.parent != page} == pictures
    assert all(path.read_bytes()[8:12] == b"WEBP" for path in pictures)


def test_those_of_the_database_are_among_them_and_all_are_small() -> None:
    assert set(physically_based.materials()) <= set(INDEX["materials"])
    sizes = {name: thumbnails.picture("materials", name).stat().st_size for name in INDEX["materials"]}
    assert max(sizes.values()) <= MOST_BYTES, sizes
    assert sum(sizes.values()) <= MOST_OF_ALL


def test_a_fingerprint_tells_materials_and_light_apart(monkeypatch: pytest.MonkeyPatch) -> None:
    gold, wax = (thumbnails.fingerprint("materials", name) for name in ("gold", "wax"))
    assert gold != wax
    document = presets.get("materials", "gold")
    monkeypatch.setattr(presets, "get", _with(presets.get, "gold", dict(reversed(document.items()))))
    assert thumbnails.fingerprint("materials", "gold") == gold, "the order of a document says nothing"
    monkeypatch.setattr(presets, "get", _with(presets.get, "gold", document | {"roughness": 0.21}))
    assert thumbnails.fingerprint("materials", "gold") != gold
    monkeypatch.setattr(stages, "chosen", lambda *_: stages.ball)
    assert thumbnails.fingerprint("materials", "wax") != wax


def _with(get: Any, name: str, document: dict[str, Any]) -> Any:
    return lambda kind, wanted: document if (kind, wanted) == ("materials", name) else get(kind, wanted)


def test_a_material_stands_where_it_shows_what_it_is() -> None:
    chosen = {
        name: stages.chosen(name, stages.surface(presets.get("materials", name))) for name in INDEX["materials"]
    }
    used = Counter(stage.__name__ for stage in chosen.values())
    assert used["ball"] > len(chosen) / 2, "those of one shape are compared with one another"
    for name in ("skin", "wax", "milk", "jade", "chalk", "porcelain"):
        assert chosen[name] is stages.back_lit, name
    for name in ("glass", "amber", "physically-based-wine-red"):
        assert chosen[name] is stages.clear, name
    for name in ("rubber", "velvet", "physically-based-musou-black"):
        assert chosen[name] is stages.rim_lit, name
    for name, document in ((name, stages.surface(presets.get("materials", name))) for name in chosen):
        if document.get("thin_walled"):
            assert chosen[name] in (stages.window, stages.leaf, stages.lantern), name
    assert set(stages.SHOWN) <= set(chosen), "a stage for a preset that is gone"


@pytest.mark.parametrize("name", ["amber", "water", "physically-based-cola", "physically-based-blood-oxygenated"])
def test_what_absorbs_is_shown_so_small_that_light_passes(name: str) -> None:
    material = stages.sized(presets.get("materials", name))
    through = [math.exp(math.log(c) * 2 / material["attenuation_distance"]) for c in material["attenuation_color"]]
    assert max(through) > 0.1, "across the ball, whose radius is 1"
    assert name != "water" or min(through) > 0.95, "a drop of water is clear"


@pytest.mark.parametrize("name", ["shell", "brilliant", "lampshade"])
def test_the_shapes_are_closed_and_face_outwards(name: str) -> None:
    shape = getattr(shapes, name)()
    points, faces = np.array(shape["vertices"]), np.array(shape["faces"])
    points = points.round(4)
    corners = np.unique(points, axis=0, return_inverse=True)[1].reshape(-1)[faces]
    corners = corners[(corners != np.roll(corners, 1, axis=1)).all(axis=1)]  # without what has shrunk to a point
    edges = Counter(tuple(edge) for face in corners for edge in zip(face, np.roll(face, -1), strict=True))
    assert all(edges[b, a] == n for (a, b), n in edges.items()), "every edge is walked in both ways"
    a, b, c = points[faces].transpose(1, 0, 2)
    assert (np.cross(a, b) * c).sum() > 0, "the volume"


def test_a_brilliant_has_its_facets() -> None:
    shape = shapes.brilliant()
    points, faces = np.array(shape["vertices"]), np.array(shape["faces"])
    a, b, c = points[faces].transpose(1, 0, 2)
    normals = np.cross(b - a, c - a)
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    facets = np.unique((normals / length)[length[:, 0] > 1e-6].round(2), axis=0)
    above, below = (facets[:, 1] > 0.2).sum(), (facets[:, 1] < -0.2).sum()
    assert (above, below) == (1 + 8 + 8 + 16, 8 + 16)
    assert shape["smooth"] is False
