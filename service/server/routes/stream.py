"""The stream's WebSocket."""

from __future__ import annotations

import asyncio
import json

from fastapi import APIRouter, WebSocket, WebSocketDisconnect
from starlette.websockets import WebSocketState

from service.problems import NotFound, ServiceError, TooManyRequests
from service.server.state import app_state, owner_of
from service.server.streams.stream import LOST, Attendance, Stream

router = APIRouter()

SUBPROTOCOL = "sunbox.v1"
CLOSE_CODES: dict[type[ServiceError], int] = {NotFound: 4404, TooManyRequests: 4429}
REASON_CHARACTERS = 100  # a close frame has room for 123 bytes


@router.websocket("/v1/stream")
async def stream(socket: WebSocket) -> None:
    state = app_state(socket)
    await socket.accept(SUBPROTOCOL if SUBPROTOCOL in socket.scope["subprotocols"] else None)
    try:
        info = await state.info()
        try:
            session = state.sessions.enter(socket.query_params.get("session"), owner_of(socket))
        except ServiceError as error:
            code = CLOSE_CODES.get(type(error), LOST)
            return await socket.close(code, error.detail[:REASON_CHARACTERS])
        try:
            await socket.send_text(json.dumps({"type": "hello", "session": session.id, **info}))
            await _until_closed(socket, session.stream)
        finally:
            state.sessions.leave(session)
    except WebSocketDisconnect:
        return
    except RuntimeError:  # Starlette raises it for a message to a connection that was closed meanwhile
        if socket.application_state is not WebSocketState.DISCONNECTED:
            raise


async def _until_closed(socket: WebSocket, client: Stream) -> None:
    attendance: Attendance = client.attach(socket)
    attending = asyncio.create_task(client.attend(attendance))
    listening = asyncio.create_task(_listen(socket, client))
    try:
        done, _ = await asyncio.wait({attending, listening}, return_when=asyncio.FIRST_COMPLETED)
        for task in done:
            task.result()
    finally:
        attending.cancel()
        listening.cancel()
        await asyncio.gather(attending, listening, return_exceptions=True)


async def _listen(socket: WebSocket, client: Stream) -> None:
    while True:
        message = await socket.receive()
        if message["type"] == "websocket.disconnect":
            return
        await client.hear(message.get("text"))
