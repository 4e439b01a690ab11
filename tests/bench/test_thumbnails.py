"""The editor's pictures of presets are of these presets, in this light."""

from __future__ import annotations

import json

from service import presets
from tests.bench import thumbnails


def test_every_preset_has_a_picture_of_itself() -> None:
    """Else: `python -m tests.bench thumbnails`."""
    index = json.loads((thumbnails.FOLDER / "index.json").read_text())
    names = [entry["name"] for entry in presets.names("materials")]
    assert index == {name: thumbnails.fingerprint(presets.get("materials", name)) for name in names}
    assert {path.stem for path in thumbnails.FOLDER.glob("*.webp")} == set(names)
    assert all((thumbnails.FOLDER / f"{name}.webp").read_bytes()[8:12] == b"WEBP" for name in names)


def test_a_fingerprint_tells_materials_and_light_apart() -> None:
    gold, chalk = (presets.get("materials", name) for name in ("gold", "chalk"))
    assert thumbnails.fingerprint(gold) != thumbnails.fingerprint(chalk)
    assert thumbnails.fingerprint(gold) == thumbnails.fingerprint(dict(reversed(gold.items())))
