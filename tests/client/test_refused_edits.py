"""An edit that is refused is told once, and frames of the last valid scene go on coming: a server of a few lines
plays what a real one sends, in every order."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Awaitable, Callable
from typing import Any

import pytest
from websockets.asyncio.server import ServerConnection, serve

import sunbox

SCENE = {"version": 1, "materials": {"ball": {"roughness": 0.5}}}
POINTER = "/scene/materials/ball/roughness"
Script = list[Any]
PATIENCE_S = 30.0


def frame(generation: int, samples: int) -> bytes:
    header = {
        "generation": generation, "seq": 10 * generation + samples, "samples": samples, "width": 1, "height": 1,
        "mime": "application/octet-stream", "noise": None, "elapsed_s": 0.0, "eta_s": None, "scale": 1.0,
    }  # fmt: skip
    text = json.dumps(header).encode()
    return len(text).to_bytes(4, "little") + text + bytes(16)


def done(generation: int, samples: int) -> str:
    return json.dumps({"type": "done", "generation": generation, "reason": "max_samples", "samples": samples})


def refusal(generation: int) -> str:
    errors = [{"pointer": POINTER, "detail": "must be at most 1"}]
    problem = {"title": "Invalid", "status": 422, "detail": "must be at most 1", "errors": errors}
    return json.dumps({"type": "error", "generation": generation, "problem": problem})


# What the server sends at once, and what after the edit: at the end, four samples are done.
SCRIPTS: dict[str, tuple[Script, Script]] = {
    "before the first frame": ([], [refusal(1), frame(0, 1), frame(0, 4), done(0, 4)]),
    "between frames": ([frame(0, 1)], [frame(0, 2), refusal(1), frame(0, 4), done(0, 4)]),
    "the last frame came before the refusal": ([frame(0, 1)], [frame(0, 4), refusal(1), done(0, 4)]),
    "the end came before the refusal": ([frame(0, 1)], [frame(0, 4), done(0, 4), refusal(1)]),
    "the end came first": ([frame(0, 1)], [done(0, 4), refusal(1), frame(0, 4)]),
    "all was done before the edit": ([frame(0, 4), done(0, 4)], [refusal(1)]),
    "the renderer failed after a first look": (
        [frame(0, 1)],
        [frame(1, 1), refusal(1), frame(0, 2), frame(0, 4), done(0, 4)],
    ),
}


def against(script: tuple[Script, Script], test: Callable[[str], Awaitable[None]]) -> None:
    """Run a test with the address of a server that plays a script."""

    async def play(connection: ServerConnection) -> None:
        await connection.send(json.dumps({"type": "hello", "session": "s"}))
        async for text in connection:
            kind = json.loads(text)["type"]
            for message in script[0] if kind == "start" else script[1] if kind == "update" else ():
                await connection.send(message)

    async def run() -> None:
        async with serve(play, "127.0.0.1", 0, subprotocols=["sunbox.v1"]) as server:  # type: ignore[list-item]
            port = server.sockets[0].getsockname()[1]
            await asyncio.wait_for(test(f"http://127.0.0.1:{port}"), PATIENCE_S)

    asyncio.run(run())


@pytest.mark.parametrize("script", SCRIPTS.values(), ids=SCRIPTS.keys())
def test_frames_go_on_after_a_refused_edit(script: tuple[Script, Script]) -> None:
    async def test(url: str) -> None:
        async with sunbox.AsyncClient(url) as client, client.stream(SCENE) as stream:
            seen = [await anext(stream)] if script[0] else []
            if stream.done is not None or len(script[0]) > 1:
                seen += [each async for each in stream]
            await stream.update({"materials": {"ball": {"roughness": 3}}})
            with pytest.raises(sunbox.Refused) as refused:
                seen += [each async for each in stream]
            assert refused.value.pointer == POINTER
            seen += [each async for each in stream]
            assert seen[-1].samples == 4 and seen[-1].generation == stream.generation == 0
            assert stream.done is not None and stream.done["samples"] == 4
            assert stream.scene == SCENE

    against(script, test)


def test_frames_go_on_without_await_too() -> None:
    def watched(url: str) -> None:
        with sunbox.Client(url) as client, client.stream(SCENE) as stream:
            next(stream)
            stream.update({"materials": {"ball": {"roughness": 3}}})
            with pytest.raises(sunbox.Refused, match="at most 1"):
                list(stream)
            assert [each.samples for each in stream][-1] == 4 and stream.scene == SCENE

    async def test(url: str) -> None:
        await asyncio.to_thread(watched, url)

    for script in ("between frames", "the end came before the refusal"):
        against(SCRIPTS[script], test)
