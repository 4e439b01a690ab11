"""What the schema's hints say about a field that follows another, against what is rendered."""

from __future__ import annotations

import io

import numpy as np
import pytest

from service.document import schema
from tests.marks import seldom
from tests.serving import SCENE, SMALL, Server


@pytest.mark.parametrize("field", seldom(["ior", "clearcoat_roughness"], ["clearcoat_roughness"]))
def test_a_field_that_follows_another_says_what_it_comes_to(server: Server, field: str) -> None:
    """Rendered with the value that the hint has and without one, the picture is the same."""
    follows = schema()["scene"]["$defs"]["PrincipledMaterial"]["properties"][field]["x-follows"]
    xs, ys = np.asarray(follows["points"]).T
    assert xs[0] == 0 and xs[-1] == 1 and (np.diff(xs) > 0).all()

    def picture(value: float | None) -> np.ndarray:
        own = {} if value is None else {field: value}
        ball = {"type": "principled", "clearcoat": 1, "transmission": 0.5, "roughness": 0.2, follows["field"]: 0.3}
        scene = SCENE | {"materials": SCENE["materials"] | {"ball": ball | own}}
        answer = server.http.post("/v1/render?format=npy", json={"scene": scene, "settings": SMALL})
        return np.load(io.BytesIO(answer.content))

    absent = picture(None)
    near = np.abs(absent - picture(float(np.interp(0.3, xs, ys)))).mean()
    far = [np.abs(absent - picture(float(ys[end]))).mean() for end in (0, -1)]
    assert near < 0.02 * min(far), "another value is seen in the picture"
