"""`microfacet` under the hand: each edit of a stream shows what a new stream of the edited scene shows."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
import pytest

from tests.marks import seldom
from tests.serving import SCENE, SMALL, Server, client
from tests.streams import RAW

BEGUN: dict[str, Any] = {"type": "microfacet", "distribution": "sgd", "alpha": 0.3, "gamma": 0.5, "f0": 0.3}
EDITS: dict[str, dict[str, Any]] = {
    "a slider": {"alpha": 0.9},
    "a slider of the shape": {"gamma": 1.9},
    "another distribution": {"distribution": "phong", "alpha": 300},
    "other terms": {"geometry": "kelemen", "fresnel": "dielectric", "diffuse": 0.4, "diffuse_model": "eon"},
    "another model": {"type": "phong", "diffuse": 0.5, "specular": 0.3, "shininess": 30},
}


def scene(material: dict[str, Any]) -> dict[str, Any]:
    out = copy.deepcopy(SCENE)
    out["materials"]["ball"] = material
    return out


def shown(server: Server, material: dict[str, Any]) -> np.ndarray:
    with client(server) as stream:
        stream.start(scene=scene(material), settings=SMALL, view=RAW)
        return stream.finished()[1].array()


# Each other one brings kernels of its own.
@pytest.mark.parametrize("edit", seldom(EDITS, [*EDITS][1:]))
def test_an_edit_shows_what_a_new_stream_shows(server: Server, edit: str) -> None:
    after = EDITS[edit] if "type" in EDITS[edit] else BEGUN | EDITS[edit]
    with client(server) as stream:
        stream.start(scene=scene(BEGUN), settings=SMALL, view=RAW)
        before = stream.finished()[1].array()
        stream.say("update", generation=2, scene={"materials": {"ball": EDITS[edit]}})
        found = stream.finished()[1]
    assert found.generation == 2 and np.abs(found.array() - before).max() > 0.01
    np.testing.assert_allclose(found.array(), shown(server, after), rtol=1e-4, atol=1e-5)


@pytest.mark.slow  # the kernel of both models' code; that flags grow with an edit, test_untouched_parts.py has
def test_an_edit_brings_the_first_microfacet(server: Server) -> None:
    with client(server) as stream:
        stream.start(scene=SCENE, settings=SMALL, view=RAW)
        stream.finished()
        stream.say("update", generation=2, scene={"materials": {"ball": BEGUN}})
        found = stream.finished()[1]
    np.testing.assert_allclose(found.array(), shown(server, BEGUN), rtol=1e-4, atol=1e-5)
