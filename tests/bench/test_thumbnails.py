"""The editor's pictures of presets are of these presets, in this light."""

from __future__ import annotations

import json

from tests.bench import thumbnails


def test_every_preset_has_a_picture_of_itself() -> None:
    """Else: `python -m tests.bench thumbnails`."""
    index = json.loads((thumbnails.FOLDER / "index.json").read_text())
    assert index == thumbnails.wanted()
    pictures = {thumbnails.picture(kind, name) for kind, all_of_it in index.items() for name in all_of_it}
    assert set(thumbnails.FOLDER.rglob("*.webp")) == pictures
    assert all(path.read_bytes()[8:12] == b"WEBP" for path in pictures)


def test_a_fingerprint_tells_materials_and_light_apart() -> None:
    gold, chalk = (thumbnails.scene("materials", name) for name in ("gold", "chalk"))
    assert thumbnails.fingerprint(gold) != thumbnails.fingerprint(chalk)
    assert thumbnails.fingerprint(gold) == thumbnails.fingerprint(dict(reversed(gold.items())))
