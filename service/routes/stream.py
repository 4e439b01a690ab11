"""The stream's WebSocket."""

from __future__ import annotations

import asyncio
import json

from fastapi import APIRouter, WebSocket, WebSocketDisconnect
from starlette.websockets import WebSocketState

from service.problems import Unavailable
from service.rendering.stream import LOST, Stream
from service.routes.house import house

router = APIRouter()

SUBPROTOCOL = "sunbox.v1"


@router.websocket("/v1/stream")
async def stream(socket: WebSocket) -> None:
    own = house(socket)
    await socket.accept(SUBPROTOCOL if SUBPROTOCOL in socket.scope["subprotocols"] else None)
    own.sockets.add(socket)
    try:
        info = await own.info()
        await socket.send_text(json.dumps({"type": "hello", **info}))
        try:
            client = Stream(own.engine, own.reader, socket)
        except Unavailable as error:
            return await socket.close(LOST, error.detail[:100])
        await _until_closed(socket, client)
    except WebSocketDisconnect:
        return
    except RuntimeError:  # of Starlette, for what was to be sent when the server had just said farewell
        if socket.application_state is not WebSocketState.DISCONNECTED:
            raise
    finally:
        own.sockets.discard(socket)


async def _until_closed(socket: WebSocket, client: Stream) -> None:
    running = asyncio.create_task(client.run())
    listening = asyncio.create_task(_listen(socket, client))
    try:
        done, _ = await asyncio.wait({running, listening}, return_when=asyncio.FIRST_COMPLETED)
        for task in done:
            task.result()
    finally:
        running.cancel()
        listening.cancel()
        await asyncio.gather(running, listening, return_exceptions=True)


async def _listen(socket: WebSocket, client: Stream) -> None:
    while True:
        message = await socket.receive()
        if message["type"] == "websocket.disconnect":
            return
        await client.hear(message.get("text"))
