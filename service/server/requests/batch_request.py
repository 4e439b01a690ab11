"""The body of `POST /v1/batches`: a scene, its settings, and the axes along which they vary."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, Any

from pydantic import Field, TypeAdapter

from service.config import Config
from service.document import load_json, references
from service.document.axes import Axis, StoredAxis, Times, Variations
from service.document.document import Parsed
from service.document.validation import validated
from service.problems import FieldError, InvalidDocument
from service.server.requests.request_parser import RenderRequest, RequestParser, digest_of, folded, unfolded

MOST_AXES = 16


class _BatchRequest(RenderRequest):
    over: Annotated[list[Axis], Field(min_length=1, max_length=MOST_AXES)]


_BATCH_REQUEST = TypeAdapter(_BatchRequest)
_AXES: TypeAdapter[list[Any]] = TypeAdapter(list[Axis])
_STORED_AXES: TypeAdapter[list[Any]] = TypeAdapter(list[StoredAxis])


@dataclass(frozen=True)
class ParsedBatch:
    """A batch whose every step is valid, the other axes being at their first. `body` is the folded `{scene,
    settings}` that varies."""

    body: bytes
    axes: str  # JSON
    renders: int
    uses: list[tuple[str, str]]  # JSON pointers of assets, in the scene or at the step that names them, and their ids
    label: str | None
    priority: int
    digest: str  # of the body as parsed JSON
    callback: str | None = None  # URL


def parse_batch(config: Config, body: bytearray | memoryview) -> ParsedBatch:
    """Takes time in proportion to the sum of the axes' lengths. Raises InvalidDocument with pointers from the root of
    the body, MalformedJson."""
    document = load_json(body)
    request = validated(_BATCH_REQUEST, document, "")
    base = {"scene": request.scene, "settings": request.settings}
    variations = Variations(base, request.over)
    if len(variations) > config.max_batch:
        detail = f"makes {len(variations)} renders: no more than {config.max_batch} are allowed (SUNBOX_MAX_BATCH)"
        raise InvalidDocument([FieldError("/over", detail)])
    _check(RequestParser(config), variations)
    axes = _AXES.dump_json(request.over, exclude_unset=True).decode()
    digest = digest_of(document)
    return ParsedBatch(
        folded(base), axes, len(variations), list(_uses(variations)), request.label, request.priority, digest,
        request.callback,
    )  # fmt: skip


def variations(base: Any, axes: str) -> Variations:
    """The variations of a stored batch."""
    return Variations(base, _STORED_AXES.validate_json(axes))


def variations_of(axes: str) -> Variations:
    """The axes alone, for their names."""
    return variations({}, axes)


def times_of(axes: str) -> dict[int, Times]:
    """The axes of a request that are times of an animation, by their places."""
    return {i: axis for i, axis in enumerate(_AXES.validate_json(axes)) if isinstance(axis, Times)}


def document_of_step(body: bytes, axes: str, step: int) -> bytes:
    """The folded scene of a batch at a step. Raises InvalidDocument."""
    return folded(variations(json.loads(unfolded(body)), axes).document(step)["scene"])


def _uses(variations: Variations) -> Iterator[tuple[str, str]]:
    """The assets of all renders' scenes, each of which stands in the base or in what one step writes."""
    for pointer, ref in references.pointed(variations.base["scene"]):
        yield f"/scene{pointer}", ref
    for i, axis in enumerate(variations.axes):
        for step in range(len(axis)):
            for ref in references.references(axis.written(step)):
                yield f"/over/{i}{axis.pointer(step)}", ref


def _check(parser: RequestParser, variations: Variations) -> None:
    """Raise InvalidDocument for a step that is not valid; of each scene only what differs from the first one's is
    validated."""
    first = _first(variations)
    try:
        scene, _ = parser.both(first["scene"], first["settings"])
    except InvalidDocument as error:
        raise _of_first_steps(parser, variations, error) from None
    known = Parsed(first["scene"], scene)
    for pointer, document in _steps(variations):
        try:
            parser.scene(document["scene"], known)
            if document["settings"] is not first["settings"]:
                parser.settings(document["settings"])
        except InvalidDocument as error:
            raise _at(pointer, error) from None


def _first(variations: Variations) -> Any:
    try:
        return variations.document(0)
    except InvalidDocument as error:
        raise error.under("/over") from None


def _steps(variations: Variations) -> Iterator[tuple[str, Any]]:
    try:
        yield from variations.one_by_one()
    except InvalidDocument as error:
        raise error.under("/over") from None


def _of_first_steps(parser: RequestParser, variations: Variations, error: InvalidDocument) -> InvalidDocument:
    """The error of the axis whose first step made a valid document invalid; or that of the base."""
    for i in reversed(range(len(variations.axes))):
        before = _first(Variations(variations.base, variations.axes[:i]))
        try:
            parser.both(before["scene"], before["settings"])
        except InvalidDocument as earlier:
            error_of_base = earlier
        else:
            return _at(f"/{i}{variations.axes[i].pointer(0)}", error)
    return error_of_base


def _at(pointer: str, error: InvalidDocument) -> InvalidDocument:
    """The mistakes of a document, seen from the step that made them."""
    return InvalidDocument([FieldError(f"/over{pointer}", f"{each.pointer}: {each.detail}") for each in error.errors])
