"""Sources that the commands compare: scenes, pictures with their layers, renders on a server; and the words for
results."""

from __future__ import annotations

import argparse
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from service.cli import BadInput, CommandError, Failed, files

if TYPE_CHECKING:
    from service.cli.documents import Source
    from service.config import Config
    from sunbox import Client, Verdict

SAME, DIFFERENT, COULD_NOT = 0, 1, 3  # exit codes
SHOWN_REGIONS = 4
RENDER = re.compile(r"[0-9a-f]{32}")


class CouldNotCompare(CommandError):
    """There is no verdict, which must not look like one."""

    exit_code = COULD_NOT


@dataclass(frozen=True)
class Input:
    """A side of a comparison: a scene with its settings; or a picture, which is sent as it is, and whose settings are
    those of a scene beside it that has none; or the id of a render."""

    name: str
    source: Source | None = None
    picture: Path | None = None

    @property
    def settings(self) -> dict[str, Any]:
        return self.source.settings if self.source is not None else {}


def read_input(name: str, arguments: argparse.Namespace, config: Config) -> Input:
    """Raises BadInput."""
    from service.cli.documents import read_source
    from service.formats.images.metadata import exr_attributes

    path = Path(name)
    if arguments.server is not None and not path.exists() and RENDER.fullmatch(name):
        return Input(name)
    source = read_source(path, arguments.asset_root, config)
    layered = b"variance.R\0" in exr_attributes(files.read(path)).get("channels", b"")
    return Input(name, source, path if layered else None)


def chosen(a: Input, b: Input, arguments: argparse.Namespace, config: Config) -> list[dict[str, Any]]:
    """The settings of each side: its own, or the other one's, and those of the command line. Raises BadInput."""
    from service.cli.documents import read_settings

    texts = arguments.set or []
    base = [each.settings or other.settings for each, other in ((a, b), (b, a))]
    return [read_settings(texts, config, given).model_dump(mode="json", exclude_unset=True) for given in base]


def verdict(
    client: Client, a: Input, b: Input, settings: Sequence[dict[str, Any]], arguments: argparse.Namespace
) -> Verdict:
    """With the map that the arguments ask for, if there is one."""
    from service.cli.documents import with_uploads

    def side(one: Input, given: dict[str, Any]) -> Any:
        if one.picture is not None:
            return client.upload(one.picture)
        if one.source is None:
            return one.name
        return {"scene": with_uploads(client, one.source, arguments.asset_root), "settings": given}

    map = arguments.map if arguments.output is not None else None
    return client.compare(side(a, settings[0]), side(b, settings[1]), arguments.confidence, map)


def displayed(client: Client, one: Input, settings: dict[str, Any], arguments: argparse.Namespace) -> bytes:
    """A side's picture as a screen shows it, as PNG."""
    from service.cli.documents import with_uploads

    if one.picture is not None:
        return _png(one.picture)
    if one.source is None:
        return client.job(one.name).picture().png()
    job = client.submit(with_uploads(client, one.source, arguments.asset_root), **settings)
    try:
        return job.result().png()
    finally:
        if arguments.server is not None:
            job.delete()


def _png(path: Path) -> bytes:
    """Raises BadInput."""
    import numpy as np

    from service.formats import images
    from service.formats.errors import ParseError
    from service.formats.sandbox.sandbox import Sandbox
    from service.formats.types import AssetLimits
    from service.server.verdict.figures import displayed

    with Sandbox(AssetLimits()) as sandbox:
        try:
            picture = sandbox.parse_rendered(files.read(path))
        except ParseError as error:
            raise BadInput(f"{path}: {error}") from None
    shown = displayed(picture.layers[..., :3].astype(np.float64))
    return images.encode(np.round(255 * shown).astype(np.uint8), "png")


def check_confidence(arguments: argparse.Namespace) -> None:
    if not 0 < arguments.confidence < 1:
        raise BadInput(f"--confidence {arguments.confidence:g}: must be above 0 and below 1")


def said(found: Verdict) -> str:
    """One line."""
    samples = " and ".join(str(each) for each in dict.fromkeys(found.samples.values()))
    text = f"p = {found.p_value:.2g}, {samples} samples, FLIP {found.flip:.3g}"
    if not found.different:
        return f"the same within noise: {text}"
    shown = [f"{r.width} x {r.height} at ({r.x}, {r.y})" for r in found.regions[:SHOWN_REGIONS]]
    more = len(found.regions) - len(shown)
    return f"different: {text}; {', '.join(shown)}" + (f" and {more} more" if more > 0 else "")


def could_not(error: Failed) -> CouldNotCompare:
    return CouldNotCompare(*error.lines)
