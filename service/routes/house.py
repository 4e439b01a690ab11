"""What the routes share: the configuration, the assets, the renderer, who is connected."""

from __future__ import annotations

import asyncio
from dataclasses import dataclass, field
from importlib import metadata
from typing import Any

from starlette.requests import HTTPConnection
from starlette.websockets import WebSocket

from service.assets import AssetStore
from service.config import Config
from service.problems import Unavailable
from service.quality import PRESETS
from service.rendering.engine import Engine
from service.rendering.reading import Reader
from service.rendering.renders import Renders

STARTING_S = 15.0  # how long a caller waits for a renderer that is being started
GOING_AWAY = 1001  # close code
FAREWELL_S = 1.0  # for a client that reads slowly to be told


@dataclass
class House:
    config: Config
    assets: AssetStore
    reader: Reader
    engine: Engine
    renders: Renders = field(default_factory=Renders)
    sockets: set[WebSocket] = field(default_factory=set)  # of the open streams

    async def info(self) -> dict[str, Any]:
        """What GET /v1/info says. Waits for a renderer that is being started; null when there is none."""
        try:
            renderer: dict[str, Any] | None = await self.engine.ready(STARTING_S)
        except Unavailable:
            renderer = None
        config = self.config
        return {
            "version": metadata.version("sunbox"),
            "renderer": renderer,
            "limits": {
                "max_pixels": config.max_pixels,
                "max_triangles": config.max_triangles,
                "max_body": config.max_body,
            },
            "quality": PRESETS,
        }

    async def farewell(self) -> None:
        """Tells everybody that the server ends: closes streams, cancels renders, so that who waits gets an answer."""
        self.renders.close()
        sockets, self.sockets = self.sockets, set()
        closing = (socket.close(GOING_AWAY, "The server is shutting down.") for socket in sockets)
        await asyncio.gather(*(asyncio.wait_for(close, FAREWELL_S) for close in closing), return_exceptions=True)


def house(connection: HTTPConnection) -> House:
    found: House = connection.app.state.house
    return found
