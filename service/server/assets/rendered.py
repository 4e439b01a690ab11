"""Renders that come back as files: uploaded EXR files that Sunbox wrote with every layer."""

from service.formats.cache import refused
from service.formats.errors import ParseError
from service.formats.source import for_sandbox
from service.formats.types import RenderedPicture
from service.problems import AssetError
from service.server.assets.store import AssetStore


def rendered(assets: AssetStore, id: str) -> RenderedPicture:
    """Colour, variance and samples of an EXR file. Raises NotFound, AssetError."""
    if assets.info(id).format != "exr":
        raise AssetError("is no EXR file")
    try:
        with assets.opened(id) as source:
            return assets.loader.sandbox.parse_rendered(for_sandbox(source))
    except ParseError as error:
        raise refused("the EXR file", error) from None
