"""Scenes and settings as the command line takes them: from a file and from `--set`; mistakes become BadInput."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from service.commands import BadInput, files
from service.problems import InvalidDocument, MalformedJson, ServiceError

if TYPE_CHECKING:
    from service.config import Config
    from service.pack import Packed
    from service.scene import Scene, Settings

SHOWN_ERRORS = 8  # a mesh of NaN has a mistake in every line


@contextmanager
def refusals(place: str = "") -> Iterator[None]:
    """Turns a caller's mistake into BadInput, a line for each, `place` before the pointer."""
    try:
        yield
    except InvalidDocument as error:
        lines = [f"{place}{e.pointer or '/'}: {e.detail}" for e in error.errors]
        more = len(lines) - SHOWN_ERRORS
        raise BadInput(*lines[:SHOWN_ERRORS], *([f"and {more} more"] if more > 0 else [])) from None
    except ServiceError as error:
        raise BadInput(f"{place}{error}") from None


def read_scene(path: Path) -> Scene:
    data = files.read(path)
    from service.scene import load_json, parse_scene

    with refusals(f"{path}: "):
        document = load_json(data)
    with refusals():
        return parse_scene(document)


def read_settings(assignments: Sequence[str], config: Config) -> Settings:
    """Settings from `key=value` texts, the last of a key counting; a value is JSON or else a bare word."""
    from service.scene import parse_settings

    document = {}
    for text in assignments:
        key, equals, value = text.partition("=")
        if not equals or not key:
            raise BadInput(f"--set {text!r}: write it as key=value")
        document[key] = _value(value)
    with refusals("setting "):
        return parse_settings(document, limits=config)


def pack_scene(path: Path, scene: Scene, roots: Sequence[str], config: Config) -> Packed:
    """The scene as arrays, its assets looked up beside the file, in `roots`, and by sha256 in the data folder."""
    from service.assets import AssetStore, FileAssets
    from service.pack import pack

    folders = [Path(root) for root in roots]
    for folder in folders:
        if not folder.is_dir():
            raise BadInput(f"--asset-root {str(folder)!r}: is not a folder")
    uploaded = AssetStore(config.data_dir, config, _builtin_assets)
    with refusals(), closing(uploaded), FileAssets(path.parent, folders, uploaded) as assets:
        return pack(scene, assets, limits=config)


def _builtin_assets() -> dict[str, bytes]:
    from service import presets

    return presets.builtin_assets()


def _value(text: str) -> Any:
    from service.scene import load_json

    try:
        return load_json(text)
    except MalformedJson:
        return text
