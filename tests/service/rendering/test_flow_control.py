"""Which frame goes out when: credits, generations, views, pace."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable

import numpy as np
import pytest

from service.ipc.messages import Frame, Progress, Want
from service.problems import InvalidDocument
from service.server.streams.flow_control import PATIENCE_S, FlowControl
from service.server.streams.protocol import View
from tests.counting import in_simulated_time

PIXELS = np.zeros((1, 1, 4), np.uint8)


class Renderer:
    """What the flow asks for, answered by hand."""

    def __init__(self) -> None:
        self.wants: list[Want] = []
        self.flow = FlowControl(7, self.wants.append)
        self.flow.attach()

    def frame(self, generation: int, elapsed_s: float = 0.0) -> Frame:
        """An answer to the last want."""
        progress = Progress(1, None, elapsed_s)
        return Frame(7, self.wants[-1].serial, generation, PIXELS, progress, 1.0, False)

    def deliver(self, generation: int, elapsed_s: float = 0.0) -> bool:
        """Whether a frame was sent in answer to the last want."""
        frame = self.frame(generation, elapsed_s)
        welcome = self.flow.welcome(frame)
        if welcome:
            self.flow.sent(frame)
        return welcome


def flowing(test: Callable[[Renderer], Awaitable[None]]) -> Callable[[], None]:
    async def run() -> None:
        renderer = Renderer()
        await test(renderer)
        renderer.flow.close()

    def wrapped() -> None:
        in_simulated_time(run())

    wrapped.__doc__ = test.__doc__
    return wrapped


@flowing
async def test_nothing_is_asked_for_before_a_start(renderer: Renderer) -> None:
    renderer.flow.set_view(View(exposure=1.0))
    assert not renderer.wants
    renderer.flow.update(1, 0.0)
    assert renderer.wants[0].view.exposure == 1.0


@flowing
async def test_two_credits(renderer: Renderer) -> None:
    renderer.flow.view = View(max_fps=240)
    renderer.flow.update(1, 0.0)
    assert renderer.deliver(1)
    await asyncio.sleep(0.01)
    assert len(renderer.wants) == 2 and renderer.deliver(1)
    await asyncio.sleep(0.01)
    assert len(renderer.wants) == 2, "asked for without a credit"
    with pytest.raises(InvalidDocument):
        renderer.flow.acknowledge(3)
    renderer.flow.acknowledge(1)
    renderer.flow.acknowledge(1)
    assert len(renderer.wants) == 3


@flowing
async def test_an_old_generation_is_not_welcome(renderer: Renderer) -> None:
    renderer.flow.update(1, 0.0)
    renderer.flow.update(2, 0.0)
    assert len(renderer.wants) == 1, "the renderer answers the one want with what is newest"
    assert not renderer.deliver(1)
    assert len(renderer.wants) == 2 and renderer.deliver(2)


@flowing
async def test_a_view_replaces_the_want(renderer: Renderer) -> None:
    renderer.flow.update(1, 0.0)
    old = renderer.frame(1)
    renderer.flow.set_view(View(exposure=2.0))
    assert renderer.wants[-1].anyway and renderer.wants[-1].view.exposure == 2.0
    assert not renderer.flow.welcome(old) and len(renderer.wants) == 2
    assert renderer.deliver(1)
    await asyncio.sleep(0.05)
    assert not renderer.wants[-1].anyway


@flowing
async def test_a_view_without_a_credit_makes_what_is_under_way_unwelcome(renderer: Renderer) -> None:
    renderer.flow.view = View(max_fps=240)
    renderer.flow.update(1, 0.0)
    assert renderer.deliver(1)
    await asyncio.sleep(0.01)
    late = renderer.frame(1)
    assert renderer.deliver(1)
    renderer.flow.set_view(View(format="rgba32f"))
    assert not renderer.flow.welcome(late), "its pixels are encoded for another format"
    renderer.flow.acknowledge(2)
    assert renderer.wants[-1].view.encoding == "linear" and renderer.deliver(1)


@flowing
async def test_a_changed_view_survives_an_update(renderer: Renderer) -> None:
    renderer.flow.update(1, 0.0)
    renderer.flow.set_view(View(exposure=2.0))
    renderer.flow.update(2, 0.0)
    assert not renderer.deliver(1)
    assert renderer.wants[-1].anyway and renderer.deliver(2)


@flowing
async def test_pace_slows_but_not_for_what_was_just_asked_for(renderer: Renderer) -> None:
    renderer.flow.update(1, 0.0)
    renderer.deliver(1, elapsed_s=100.0)
    await asyncio.sleep(0.1)
    assert len(renderer.wants) == 1, "a picture of 100 s changes little in .1 s"
    renderer.flow.set_view(View(exposure=1.0))
    assert len(renderer.wants) == 2
    renderer.deliver(1, elapsed_s=100.0)
    renderer.flow.acknowledge(1)
    renderer.flow.update(2, 0.0)
    assert len(renderer.wants) == 3


@flowing
async def test_an_update_waits_for_its_predecessors_frame(renderer: Renderer) -> None:
    loop = asyncio.get_running_loop()
    await renderer.flow.idle()  # nothing was started: no wait
    renderer.flow.update(1, 0.0)
    began = loop.time()
    loop.call_later(0.05, renderer.deliver, 1)
    await renderer.flow.idle()
    assert loop.time() - began == pytest.approx(0.05)
    renderer.flow.update(2, 0.0)
    began = loop.time()
    await renderer.flow.idle()
    assert loop.time() - began == pytest.approx(PATIENCE_S), "a frame that doesn't come is not waited for"
    assert renderer.deliver(2)
    renderer.flow.update(3, 0.0)
    began = loop.time()
    await renderer.flow.idle()
    assert loop.time() == began, "without a credit no frame can come"
