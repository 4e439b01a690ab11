"""From what a caller wrote to what the renderer takes, with its limits and assets. Not for the event loop."""

from __future__ import annotations

import json
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any

from pydantic import Field, TypeAdapter

from service.assets import Assets
from service.config import Config
from service.pack import PackCache, Packed, pack
from service.problems import FieldError, InvalidDocument
from service.quality import ResolvedSettings, resolve
from service.rendering.messages import StopRule
from service.scene import Scene, load_json, parse_scene, parse_settings
from service.scene.base import Model
from service.scene.document import Parsed
from service.scene.mistakes import validated


class _Request(Model):
    scene: Any
    settings: Any = Field(default_factory=dict)


_REQUEST = TypeAdapter(_Request)


@dataclass(frozen=True)
class Order:
    """A whole request, understood; `document` is its scene as it was written, folded."""

    settings: ResolvedSettings
    packed: Packed
    document: bytes


class Reader:
    """Raises InvalidDocument with pointers from the root of the body: /scene/..., /settings/..."""

    def __init__(self, config: Config, assets: Assets) -> None:
        self._config = config
        self._assets = assets

    def request(self, body: bytes) -> Order:
        """A whole `{scene, settings}`."""
        request = validated(_REQUEST, load_json(body), "")
        scene, settings = self.both(request.scene, request.settings)
        return Order(settings, self.pack(scene), folded(request.scene))

    def both(self, scene: Any, settings: Any) -> tuple[Scene, ResolvedSettings]:
        """Both documents, or the mistakes of both."""
        errors: list[FieldError] = []
        understood: list[Any] = []
        for parse, document in ((self.scene, scene), (self.settings, settings)):
            try:
                understood.append(parse(document))
            except InvalidDocument as error:
                errors += error.errors
        if errors:
            raise InvalidDocument(errors)
        return understood[0], understood[1]

    def scene(self, document: Any, before: Parsed | None = None) -> Scene:
        """With the one `before` an edit costs only what it changes."""
        return parse_scene(document, "/scene", self._config, before)

    def settings(self, document: Any) -> ResolvedSettings:
        settings = parse_settings(document, "/settings", self._config)
        most = self._config.max_seconds
        if most is not None and settings.time_limit is not None and settings.time_limit > most:
            detail = f"must be at most {most:g} (SUNBOX_MAX_SECONDS)"
            raise InvalidDocument([FieldError("/settings/time_limit", detail)])
        resolved = resolve(settings)
        return replace(resolved, time_limit=most) if most is not None and resolved.time_limit is None else resolved

    def pack(self, scene: Scene, cache: PackCache | None = None) -> Packed:
        with _under("/scene"):
            return pack(scene, self._assets, cache, self._config)


def stop_rule(settings: ResolvedSettings) -> StopRule:
    return StopRule(settings.max_samples, settings.time_limit, settings.target_noise)


def folded(document: Any) -> bytes:
    """JSON in few bytes, for what is seldom looked at and may hold a mesh."""
    return zlib.compress(json.dumps(document, separators=(",", ":")).encode(), 1)


def unfolded(data: bytes) -> Any:
    return json.loads(zlib.decompress(data))


def weight(packed: Packed) -> int:
    """Bytes of the arrays."""
    parts = [vars(part) for part in (packed.arrays, packed.arrays.textures) if part is not None]
    return sum(getattr(value, "nbytes", 0) for part in parts for value in part.values())


@contextmanager
def _under(pointer: str) -> Iterator[None]:
    try:
        yield
    except InvalidDocument as error:
        raise error.under(pointer) from None
