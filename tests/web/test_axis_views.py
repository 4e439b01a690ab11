"""The corner of the picture that shows the world's axes, and looks along them."""

from __future__ import annotations

import numpy as np
import pytest

from tests.web.editing import document
from tests.web.editor import Editor


def test_views_along_the_axes(editor: Editor) -> None:
    page = editor.page
    views = page.get_by_role("group", name="Views along the axes")
    first = document(editor)["camera"]
    target = np.array(first["target"])
    far = np.linalg.norm(np.array(first["position"]) - target)
    for name, from_ in {"Front": [0, 0, 1], "Top": [0, 1, 0], "Side": [1, 0, 0]}.items():
        before = views.locator("svg").inner_html()
        views.get_by_role("button", name=name).press("Enter")
        arm = np.array(document(editor)["camera"]["position"]) - target
        assert np.linalg.norm(arm) == pytest.approx(far, rel=1e-4)
        assert arm @ from_ / far > 0.999, name
        editor.wait("other axes", lambda before=before: views.locator("svg").inner_html() != before)
    for _ in range(3):
        page.keyboard.press("Control+z")
    assert document(editor)["camera"] == first
