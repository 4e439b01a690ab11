"""Edits that take long to pack, and large ones, as the renderer's process takes them."""

from __future__ import annotations

import os
import signal
import time
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from gpu import Renderer, SceneEdit
from service.document import parse_scene
from service.ipc import messages
from service.ipc.messages import Done, Frame, Image, Loaded, Read, StopRule, Update, View, Want
from service.ipc.task_control import Hold
from service.pack import pack
from service.renderers.local.supervisor import Supervisor
from service.worker.task import HOLD_S
from tests.documents import Shelf
from tests.serving import SCENE
from tests.supervisors import ENDLESS, LINEAR, Ears, Rendering, settings


@pytest.fixture(scope="module")
def arrays(gpu: Renderer) -> Any:
    return pack(parse_scene(SCENE), Shelf()).arrays


def test_a_held_task_stands_still_for_a_moment_or_until_its_update(rendering: Rendering, arrays: Any) -> None:
    async def test(supervisor: Supervisor) -> None:
        ears = Ears()
        task = supervisor.open(ears)
        await supervisor.send_scene(Update(task, 1, arrays, settings(), ENDLESS, interactive=True))
        supervisor.send(Want(task, 1, View()))
        await ears.next(Frame)
        for serial, ended_by in enumerate(("time", "an update"), 2):
            began = time.monotonic()
            supervisor.send(Hold(task))
            supervisor.send(Want(task, 2 * serial, View(), anyway=True))
            held = await ears.next(Frame)
            if ended_by == "an update":
                supervisor.send(Update(task, 2, edit=SceneEdit(camera=arrays.camera), base=1))
            supervisor.send(Want(task, 2 * serial + 1, View()))
            frame = await ears.next(Frame)
            stood_s = time.monotonic() - began
            if ended_by == "time":
                assert frame.generation == 1 and frame.progress.samples > held.progress.samples
                assert stood_s >= HOLD_S
            else:
                assert frame.generation == 2
        supervisor.drop(task)

    rendering(test)


def test_a_large_edit_is_copied_off_the_event_loop_and_survives_the_renderer(
    rendering: Rendering, arrays: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(messages, "LARGE", 0)
    dim = replace(arrays.environment, scale=0.25)
    turn = dim.rotation, dim.scale

    async def test(supervisor: Supervisor) -> None:
        def send(update: Update) -> None:
            raise AssertionError("this is the event loop")

        seen = []
        for edited in (True, False):
            ears = Ears()
            task = supervisor.open(ears)
            scene = arrays if edited else replace(arrays, environment=dim)
            await supervisor.send_scene(Update(task, 1, scene, settings(), StopRule(4), interactive=True))
            await ears.next(Done)
            if edited:
                edit = Update(task, 2, edit=SceneEdit(environment=turn, environment_map=dim), base=1)
                assert edit.is_large
                with monkeypatch.context() as patch:
                    patch.setattr(supervisor, "send", send)
                    await supervisor.send_scene(edit)
                assert (await ears.next(Loaded)).generation == 2  # else all such edits would be kept
                assert (await ears.next(Done)).generation == 2
            supervisor.send(Read(task, 1, LINEAR))
            seen.append(np.array((await ears.next(Image)).pixels))
            if edited:
                pid = supervisor.process_id
                assert pid is not None
                os.kill(pid, signal.SIGKILL)
                assert (await ears.next(Done)).generation == 2  # of the next one
                supervisor.send(Read(task, 2, LINEAR))
                seen.append(np.array((await ears.next(Image)).pixels))
            supervisor.drop(task)
        assert np.array_equal(seen[0], seen[2]) and np.array_equal(seen[1], seen[2])

    rendering(test)
