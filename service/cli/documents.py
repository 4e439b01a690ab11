"""Scenes and settings as the command line takes them: from a file and from `--set`; mistakes become BadInput."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from threading import Thread
from typing import TYPE_CHECKING, Any

from service.cli import BadInput, files
from service.problems import InvalidDocument, MalformedJson, ServiceError

if TYPE_CHECKING:
    from service.cli.assets import SourceAssets
    from service.config import Config
    from service.document import Scene, Settings
    from service.formats.images.recipe import PictureView
    from service.pack import Packed
    from service.server.assets import AssetStore
    from sunbox import Client

WIDEST = 16.0  # most width over height of a picture whose size a model's file decides
SHOWN_ERRORS = 8  # of a document: a mesh of NaN has a mistake in every line


@contextmanager
def refusals(place: str = "") -> Iterator[None]:
    """A context that turns errors in the input into BadInput, a line for each, with `place` before the pointer."""
    try:
        yield
    except InvalidDocument as error:
        lines = [f"{place}{e.pointer or '/'}: {e.detail}" for e in error.errors]
        more = len(lines) - SHOWN_ERRORS
        raise BadInput(*lines[:SHOWN_ERRORS], *([f"and {more} more"] if more > 0 else [])) from None
    except ServiceError as error:
        raise BadInput(f"{place}{error}") from None


@dataclass(frozen=True)
class Source:
    """A scene from a file; from a picture of Sunbox's also its settings and its view."""

    path: Path
    document: Any
    scene: Scene
    settings: dict[str, Any] = field(default_factory=dict)
    view: PictureView | None = None
    assets: dict[str, str] = field(default_factory=dict)  # names of files by the id that the document uses
    pointer: str = ""  # to the scene, from the root of what was read
    store: AssetStore | None = None  # of a model: its meshes and images
    aspect_ratio: float | None = None  # of the picture of a model's camera, width over height
    warned: frozenset[str] = frozenset()  # texts of the printed warnings about a model, without their places


def read_source(path: Path, roots: Sequence[str], config: Config, entry: str | None = None) -> Source:
    """The scene that a document, a model, or the metadata of a PNG or EXR describes; of several models in a zip that
    which `entry` names."""
    data = files.read(path)
    from service.cli.models import is_model

    if is_model(path, data):
        return _model(path, data, roots, config, entry)
    if entry is not None:
        raise BadInput("--entry: names a model of a zip; the input is none")
    from service.document import load_json, parse_scene
    from service.formats.images.metadata import EXR_MAGIC, PNG_MAGIC, is_webp, read_metadata

    if data.startswith((PNG_MAGIC, EXR_MAGIC)) or is_webp(data):
        from service.formats.images import recipe

        metadata = read_metadata(data)
        if metadata is None:
            raise BadInput(f"{path}: is a picture without a scene in its metadata: Sunbox did not make it")
        with refusals():
            made = recipe.read(metadata)
            scene = parse_scene(made.scene, "/scene")
        return Source(path, made.scene, scene, made.settings, made.view, made.assets, "/scene")
    with refusals(f"{path}: "):
        document = load_json(data)
    with refusals():
        return Source(path, document, parse_scene(document))


def _model(path: Path, data: bytes, roots: Sequence[str], config: Config, entry: str | None) -> Source:
    from service.cli.models import import_model
    from service.document import parse_scene, presets
    from service.formats.images.recipe import PictureView
    from service.server.assets import FileAssets
    from service.server.storage.stores import storage

    store = storage(config).assets
    if path.suffix.lower() != ".mtlx":
        _expect_meshes()
    try:
        with refusals(), FileAssets(path.parent, asset_folders(roots), store) as files_:
            model = import_model(path, data, store, files_, entry=entry)
            if model.kind == "materials":
                raise BadInput(f"{str(path)!r}: holds materials and no shapes; `sunbox import` writes them")
            document = model.scene(presets.default_environment())
            view = None if model.exposure is None else PictureView(exposure=model.exposure)
            aspect = model.aspect_ratio
            warned = frozenset(warning["detail"] for warning in model.warnings)
            scene = parse_scene(document)
            return Source(path, document, scene, view=view, store=store, aspect_ratio=aspect, warned=warned)
    except BaseException:
        store.close()
        raise


def read_settings(assignments: Sequence[str], config: Config, base: dict[str, Any] | None = None) -> Settings:
    """Settings from `key=value` texts, of which the last of a key counts; a value is JSON or else a bare word.

    `base` has the settings that the texts leave out, except for the knobs of another quality.
    """
    from service.document import parse_settings
    from service.document.quality import PRESETS

    document: dict[str, Any] = {}
    for text in assignments:
        key, equals, value = text.partition("=")
        if not equals or not key:
            raise BadInput(f"--set {text!r}: write it as key=value")
        document[key] = _value(value)
    knobs = PRESETS["balanced"] if "quality" in document else {}
    document = {key: value for key, value in (base or {}).items() if key not in knobs} | document
    with refusals("setting "):
        return parse_settings(document, limits=config)


def picture_size(settings: Settings, aspect: float | None) -> dict[str, int]:
    """The missing width or height, or both, for a model whose camera has this aspect ratio.

    Where both are missing, the number of pixels is about the default.
    """
    given = settings.model_fields_set & {"width", "height"}
    if aspect is None or len(given) == 2:
        return {}
    aspect = min(max(aspect, 1 / WIDEST), WIDEST)
    if given == {"width"}:
        return {"height": max(round(settings.width / aspect), 1)}
    if given == {"height"}:
        return {"width": max(round(settings.height * aspect), 1)}
    width = math.sqrt(settings.width * settings.height * aspect)
    return {"width": round(width), "height": round(width / aspect)}


@contextmanager
def source_assets(source: Source, roots: Sequence[str], config: Config) -> Iterator[SourceAssets]:
    """The scene's assets: files beside it and in `roots`, and uploads by sha256 in the data folder."""
    from service.cli.assets import SourceAssets
    from service.document import references
    from service.server.assets import FileAssets
    from service.server.storage.stores import storage

    uploaded = source.store or storage(config).assets
    if references.references(source.document):
        uploaded.start()
    with closing(uploaded), FileAssets(source.path.parent, asset_folders(roots), uploaded) as assets:
        yield SourceAssets(assets, uploaded, source.assets)


def asset_folders(roots: Sequence[str]) -> list[Path]:
    folders = [Path(root) for root in roots]
    for folder in folders:
        if not folder.is_dir():
            raise BadInput(f"--asset-root {str(folder)!r}: is not a folder")
    return folders


def pack_scene(source: Source, assets: SourceAssets, config: Config) -> Packed:
    """The scene as arrays."""
    from service.document.shape import MeshShape
    from service.pack import pack

    if source.store is None and any(isinstance(shape, MeshShape) and shape.asset for shape in source.scene.shapes):
        _expect_meshes()
    with refusals(source.pointer):
        return pack(source.scene, assets, limits=config)


def _expect_meshes() -> None:
    """Have numba loaded while a child process parses: both take about as long for a large file."""

    def load() -> None:
        from service.pack import warm_builder

        warm_builder()

    Thread(target=load).start()


def _value(text: str) -> Any:
    from service.document import load_json

    try:
        return load_json(text)
    except MalformedJson:
        return text


def with_uploads(client: Client, source: Source, asset_root: Sequence[str]) -> Any:
    """A source's scene, whose files are on the server."""
    from service.document import references
    from service.server.assets import FileAssets

    uploaded: dict[str, str] = {}
    with refusals(), FileAssets(source.path.parent, asset_folders(asset_root)) as found:
        for ref in references.references(source.document):
            if not ref.startswith("sha256:"):
                uploaded[ref] = client.upload(found.read(ref), Path(ref).name)
    return references.renamed(source.document, lambda ref: uploaded.get(ref, ref))
