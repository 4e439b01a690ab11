"""JSON becomes a valid scene and settings within the service's limits. Nothing is loaded, packed or kept."""

from __future__ import annotations

import hashlib
import json
import zlib
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Annotated, Any

from pydantic import Field, TypeAdapter

from service.callback_hosts import LONGEST_URL
from service.config import Config
from service.document import Scene, load_json, merge_patch, parse_scene, parse_settings, references
from service.document.base import Model
from service.document.document import Parsed
from service.document.quality import ResolvedSettings, resolve
from service.document.validation import both, validated
from service.problems import FieldError, InvalidDocument

LONGEST_LABEL = 200  # characters
HIGHEST_PRIORITY = 10


class SceneAndSettings(Model):
    scene: Any
    settings: Any = Field(default_factory=dict)


class RenderRequest(SceneAndSettings):
    label: Annotated[str, Field(max_length=LONGEST_LABEL)] | None = None
    priority: Annotated[int, Field(ge=-HIGHEST_PRIORITY, le=HIGHEST_PRIORITY)] = 0
    callback: Annotated[str, Field(max_length=LONGEST_URL)] | None = None


_REQUEST = TypeAdapter(SceneAndSettings)
_RENDER_REQUEST = TypeAdapter(RenderRequest)


@dataclass(frozen=True)
class ParsedRequest:
    """A whole request; `document` is its scene as it was written, folded."""

    settings: ResolvedSettings
    scene: Scene
    document: bytes
    uses: list[tuple[str, str]] = field(default_factory=list)  # JSON pointers of the scene's assets, and their ids
    label: str | None = None
    priority: int = 0
    digest: str = ""  # of the body as parsed JSON, where that was asked for
    callback: str | None = None  # URL


class RequestParser:
    """Raises InvalidDocument with pointers from the root of the body: /scene/..., /settings/..."""

    def __init__(self, config: Config) -> None:
        self._config = config

    def request(self, body: bytearray | memoryview) -> ParsedRequest:
        """A whole `{scene, settings}`. Raises MalformedJson too."""
        request = validated(_REQUEST, load_json(body), "")
        scene, settings = self.both(request.scene, request.settings)
        return ParsedRequest(settings, scene, folded(request.scene))

    def render(self, body: bytearray | memoryview, keyed: bool = False) -> ParsedRequest:
        """A whole `{scene, settings, label, priority}`; `keyed`: with its digest. Raises MalformedJson too."""
        document = load_json(body)
        request = validated(_RENDER_REQUEST, document, "")
        scene, settings = self.both(request.scene, request.settings)
        uses = [(f"/scene{pointer}", ref) for pointer, ref in references.pointed(request.scene)]
        digest = digest_of(document) if keyed else ""
        folded_scene = folded(request.scene)
        return ParsedRequest(
            settings, scene, folded_scene, uses, request.label, request.priority, digest, request.callback
        )

    def both(self, scene: Any, settings: Any) -> tuple[Scene, ResolvedSettings]:
        """The scene and the settings. Raises InvalidDocument with the mistakes of both."""
        return both(partial(self.scene, scene), partial(self.settings, settings))

    def scene(self, document: Any, before: Parsed | None = None) -> Scene:
        """The scene of a document; with the one `before`, only what an edit changed is validated."""
        return parse_scene(document, "/scene", self._config, before)

    def settings(self, document: Any) -> ResolvedSettings:
        settings = parse_settings(document, "/settings", self._config)
        most = self._config.max_seconds
        if most is not None and settings.time_limit is not None and settings.time_limit > most:
            detail = f"must be at most {most:g} (SUNBOX_MAX_SECONDS)"
            raise InvalidDocument([FieldError("/settings/time_limit", detail)])
        resolved = resolve(settings)
        return replace(resolved, time_limit=most) if most is not None and resolved.time_limit is None else resolved


def folded(document: Any) -> bytes:
    """The JSON (ASCII) of a document, compressed: it is seldom read and may contain a mesh."""
    return zlib.compress(json.dumps(document, separators=(",", ":")).encode(), 1)


def patched(document: bytes, patch: bytes) -> bytes:
    """The folded document with a folded merge patch [RFC 7396]."""
    return folded(merge_patch(json.loads(unfolded(document)), json.loads(unfolded(patch))))


def unfolded(data: bytes) -> str:
    """The JSON text."""
    return zlib.decompress(data).decode("ascii")


def digest_of(value: Any) -> str:
    """The same for equal JSON values: the order of keys, blanks, and whether 1 is written 1.0 do not matter."""
    text = json.dumps(_plain(value), sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()


def _plain(value: Any) -> Any:
    """The value with whole numbers as int."""
    if type(value) is float:
        return int(value) if value.is_integer() else value
    if type(value) is list:
        return [_plain(each) for each in value]
    if type(value) is dict:
        return {key: _plain(each) for key, each in value.items()}
    return value
