"""The latency from hand to eye in a real browser: from a slider's input event to other pixels on the canvas.

It is measured beside the server, and with 100 ms added to the round trip (50 each way). This needs playwright and
Chromium.
"""

from __future__ import annotations

import asyncio
import shutil
import tempfile
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any

from service.bench.latency import server

MOVES = 40
ADDED_S = 0.1  # seconds that are added to a round trip
CHUNK = 1 << 16
PATIENCE_MS = 60_000
FLAGS = ["--no-sandbox", "--disable-dev-shm-usage"]
BROWSERS = ("chromium", "chromium-headless-shell")  # the first that is installed; people have a whole one

# Metallic goes from one end to the other: a change of this size in a picture of 8 x 8 averages is not noise.
MEASURE = """async (moves) => {
    const slider = document.querySelector("#material-form [data-field=metallic] input[type=range]");
    const picture = document.querySelector("#picture");
    const small = new OffscreenCanvas(8, 8).getContext("2d", { willReadFrequently: true });
    const look = () => {
        small.drawImage(picture, 0, 0, 8, 8);
        return small.getImageData(0, 0, 8, 8).data;
    };
    const frame = () => new Promise(requestAnimationFrame);
    const rest = (ms) => new Promise((wake) => { setTimeout(wake, ms); });
    const times = [];
    for (let i = 0; i < moves; i += 1) {
        await rest(300 + 200 * ((i * 0.618) % 1));
        const before = look();
        const began = performance.now();
        slider.value = slider.valueAsNumber > 0.5 ? 0 : 1;
        slider.dispatchEvent(new Event("input"));
        while (!look().some((x, k) => Math.abs(x - before[k]) > 12)) {
            if (performance.now() - began > 10000) throw new Error("the picture did not change");
            await frame();
        }
        times.push(performance.now() - began);
    }
    return times;
}"""


def chromium() -> str | None:
    """The path of the program, or None where it is not installed."""
    return next(filter(None, map(shutil.which, BROWSERS)), None)


def measure() -> dict[str, float]:
    """Milliseconds, as `hand_p50_ms`, `hand_p95_ms`, and with `_far` through the longer way."""
    with tempfile.TemporaryDirectory(prefix="sunbox-bench-") as folder, server(folder) as (port, _):
        near = _moves(port)
        with _longer_way(port) as far_port:
            far = _moves(far_port)
    return {**_summary("hand", near), **_summary("hand_far", far)}


def table(figures: dict[str, float]) -> str:
    lines = ["from a slider's input event to other pixels, ms      p50    p95"]
    for name, words in (("hand", "beside the server"), ("hand_far", "through 100 ms more")):
        lines.append(f"{words:45}{figures[name + '_p50_ms']:8.0f}{figures[name + '_p95_ms']:7.0f}")
    return "\n".join(lines)


def _summary(name: str, times: list[float]) -> dict[str, float]:
    times = sorted(times)
    return {f"{name}_p50_ms": times[len(times) // 2], f"{name}_p95_ms": times[int(0.95 * len(times))]}


def _moves(port: int) -> list[float]:
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium(), args=FLAGS)
        page = browser.new_page(viewport={"width": 1280, "height": 800})
        page.goto(f"http://127.0.0.1:{port}/")
        page.wait_for_selector("#stage.live[aria-busy=false]", timeout=PATIENCE_MS)
        page.evaluate(MEASURE, 4)  # kernels are compiled, caches filled
        times: list[float] = page.evaluate(MEASURE, MOVES)
        browser.close()
    return times


@contextmanager
def _longer_way(port: int) -> Iterator[int]:
    """A port that forwards bytes in order, each way half of ADDED_S later."""
    loop = asyncio.new_event_loop()
    ready: asyncio.Future[Any] = loop.create_future()

    async def carry(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        while data := await reader.read(CHUNK):
            loop.call_later(ADDED_S / 2, writer.write, data)
        loop.call_later(ADDED_S / 2 + 0.01, writer.close)

    async def serve(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        there, back = await asyncio.open_connection("127.0.0.1", port)
        await asyncio.gather(carry(reader, back), carry(there, writer), return_exceptions=True)

    async def run() -> None:
        proxy = await asyncio.start_server(serve, "127.0.0.1", 0)
        ready.set_result(proxy.sockets[0].getsockname()[1])
        await proxy.serve_forever()

    def work() -> None:
        asyncio.set_event_loop(loop)
        with suppress(RuntimeError):  # stopped before it was complete: that is its end
            loop.run_until_complete(run())

    thread = threading.Thread(target=work, daemon=True)
    thread.start()
    try:
        yield asyncio.run_coroutine_threadsafe(_value(ready), loop).result(10)
    finally:
        loop.call_soon_threadsafe(loop.stop)
        thread.join(5)


async def _value(future: asyncio.Future[Any]) -> int:
    return int(await future)
