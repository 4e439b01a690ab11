"""The superset kernel shows what waits for its own kernel: the same picture of what sliders make of a scene."""

from __future__ import annotations

import asyncio
from typing import Any

import numpy as np
import pytest

from gpu import Renderer, RenderSettings, Scene, SceneEdit
from gpu.precompile import fallback
from service.document import parse_scene
from service.ipc.messages import Frame, Loaded, StopRule, Update, View, Want, driver_of
from service.ipc.task_control import Pause
from service.pack import pack
from service.renderers.local.supervisor import Supervisor
from service.worker.helpers.compile_client import records
from service.worker.view.first_look import FirstLook
from tests.documents import Shelf
from tests.gpu.flag_scenes import IMAGES, SCENES
from tests.marks import seldom
from tests.serving import PATIENCE_S, SCENE
from tests.supervisors import Ears, with_supervisor

pytestmark = pytest.mark.exact

SMALL = RenderSettings(24, 16, max_bounces=3, filter="box")
SIZE = {"width": 256, "height": 256}


def arrays_of(scene: dict[str, Any], images: Any = None) -> Any:
    return pack(parse_scene(scene), images or Shelf()).arrays


def same_picture(*scenes: Scene, gpu: Renderer) -> None:
    """Releases the scenes."""
    pictures = []
    for scene in scenes:
        picture = gpu.picture(scene, SMALL)
        while picture.samples < 8:  # the first turn may end when the kernel is compiled
            picture.trace(60.0, 8)
        pictures.append(picture.read())
        picture.release()
        scene.release()
    apart = np.abs(pictures[0] - pictures[1]) > 1e-3 * (pictures[0] + 0.01)
    assert np.isfinite(pictures[1]).all() and apart.mean() < 0.01, "but for paths on which rounding decides"


@pytest.mark.parametrize("name", ["CHECKERS", "LIGHT_TREE", "SMOOTH_NORMALS"])
def test_the_superset_kernel_shows_the_same_picture(gpu: Renderer, name: str) -> None:
    arrays = arrays_of(SCENES[name], IMAGES)
    same_picture(gpu.load(arrays), gpu.load_fallback(arrays, fallback.superset(arrays)), gpu=gpu)


@pytest.mark.parametrize("name", seldom(["BOXES", "CYLINDERS"], ["CYLINDERS"]))
def test_the_superset_kernel_shows_what_sliders_make_of_the_scene(gpu: Renderer, name: str) -> None:
    """A box that shines, which is six quads then, or a cylinder, which is a side and two disks, and glass that lets a
    third of all rays pass."""
    before = SCENES[name]
    glowing = {"type": "principled", "transmission": 1, "alpha": 0.67, "emission": 2}
    dull = arrays_of({**before, "materials": {"m": {"type": "principled"}}}, IMAGES)
    bright = arrays_of({**before, "materials": {"m": glowing}}, IMAGES)
    superset = fallback.superset(dull)
    key = fallback.kernel_key(bright, SMALL, superset)
    assert key in fallback.superset_keys(dull, SMALL, superset)
    assert key not in fallback.superset_keys(dull, SMALL, superset)[:1], "numbers of shapes are compiled in"
    same_picture(gpu.load(bright), gpu.load_fallback(bright, superset), gpu=gpu)


@pytest.mark.slow
def test_clamp_is_a_number_to_it(gpu: Renderer) -> None:
    arrays = arrays_of(SCENES["PRINCIPLED"], IMAGES)
    scene = gpu.load_fallback(arrays, fallback.superset(arrays))
    means = []
    for clamp in (None, 1e6, 1e-3):
        picture = gpu.picture(scene, RenderSettings(24, 16, max_bounces=3, clamp=clamp))
        picture.trace(60.0, 8)
        means.append(picture.read()[..., :3].mean())
        picture.release()
    scene.release()
    assert means[0] == means[1] > means[2] > 0


def test_what_it_does_not_know() -> None:
    known, other = arrays_of(SCENES["SPHERES"], IMAGES), arrays_of(SCENES["CHECKERS"], IMAGES)
    superset = fallback.superset(known)
    assert fallback.kernel_key(other, SMALL, superset) is None
    for unknown in ({"estimator": "light"}, {"sampler": "independent"}):
        assert fallback.kernel_key(known, RenderSettings(24, 16, **unknown), superset) is None
    adaptive = RenderSettings(24, 16, adaptive=True)
    assert fallback.kernel_key(known, adaptive, superset) is not None
    assert not fallback.settings_for(adaptive).adaptive  # type: ignore[union-attr]


@pytest.mark.parametrize("name", SCENES)
def test_the_least_kernel_has_no_flag_that_its_scene_can_do_without(name: str) -> None:
    arrays = arrays_of(SCENES[name], IMAGES)
    least = fallback.least(arrays)
    assert fallback.kernel_key(arrays, SMALL, least) is not None
    assert all(fallback.kernel_key(arrays, SMALL, least - {flag}) is None for flag in least)


def test_what_an_edit_tells_it() -> None:
    scene = {**SCENE, "environment": {"type": "constant", "radiance": 0.5}}
    arrays = arrays_of(scene)
    assert fallback.can_become(arrays, arrays)
    assert not fallback.can_become(arrays, arrays_of(scene)), "other arrays, perhaps other shapes"
    assert not fallback.can_become(arrays, arrays_of(SCENE))


async def shown(supervisor: Supervisor, ears: Ears, task: int, generation: int) -> list[Frame | Loaded]:
    """What is told of a generation until its picture is there in full."""
    told: list[Frame | Loaded] = []
    serial = 100 * generation
    supervisor.send(Want(task, serial, View(encoding="linear")))
    while True:
        message = await ears.next_of(task, Frame, Loaded)
        if message.generation != generation:
            continue
        told.append(message)
        if isinstance(message, Frame):
            if message.scale == 1.0:
                return told
            serial += 1
            supervisor.send(Want(task, serial, View(encoding="linear")))


def test_a_first_look_reports_its_noise(gpu: Renderer) -> None:
    """From its second sample on, as every picture does; here by the scene's own kernel."""
    sent: list[Any] = []
    look = FirstLook(1, sent.append, gpu)
    look.begin(gpu.load(arrays_of(SCENE)), RenderSettings(64, 64), 1)
    for _ in range(4):
        look.step()
        look.answer(Want(1, 1, View(), anyway=True))
    look.release()
    reports = [frame.progress for frame in sent]
    assert max(report.samples for report in reports) >= 2
    assert all((report.noise is None) == (report.samples < 2) for report in reports)


def test_a_first_look_is_denoised_for_the_eye_alone(gpu: Renderer) -> None:
    sent: list[Any] = []
    look = FirstLook(1, sent.append, gpu, lambda color: np.ones_like(color))
    look.begin(gpu.load(arrays_of(SCENE)), RenderSettings(64, 64), 1)
    look.step()
    views = View(denoise=True), View(), View(encoding="linear", denoise=True)
    for view in views:
        look.answer(Want(1, 1, view, anyway=True))
    look.release()
    assert [frame.denoised for frame in sent] == [True, False, False]
    assert [np.ptp(frame.pixels[..., :3]) == 0 for frame in sent] == [True, False, False]


def test_a_slider_is_shown_at_once_where_its_superset_kernel_is_there(
    gpu: Renderer, tmp_path: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A server that has nothing compiled yet: the scene's superset kernel is made first after the scene is shown."""
    monkeypatch.setenv("MESA_SHADER_CACHE_DIR", str(tmp_path))
    arrays = arrays_of(SCENE)
    superset = fallback.kernel_key(arrays, RenderSettings(**SIZE), fallback.superset(arrays))
    assert superset is not None
    record = records() / superset.digest(driver_of(gpu.info))

    async def test(supervisor: Supervisor) -> None:
        ears = Ears()
        task = supervisor.open(ears)
        await supervisor.send_scene(Update(task, 1, arrays, SIZE, StopRule(64), interactive=True))
        await ears.next_of(task, Loaded)
        async with asyncio.timeout(PATIENCE_S):
            while not record.exists():
                await asyncio.sleep(0.1)

        supervisor.send(Update(task, 2, settings={**SIZE, "clamp": 5.0}, base=1))
        told = await shown(supervisor, ears, task, 2)
        loaded = next(i for i, message in enumerate(told) if isinstance(message, Loaded))
        before, after = told[:loaded], told[loaded + 1 :]
        frames = [message for message in told if isinstance(message, Frame)]
        assert before and all(isinstance(frame, Frame) and frame.provisional for frame in before)
        assert after and not any(frame.provisional for frame in after if isinstance(frame, Frame))
        order = [(frame.scale, frame.progress.samples) for frame in frames]
        assert order == sorted(order) and len(set(order)) == len(order)
        assert all((frame.progress.noise is None) == (frame.progress.samples < 2) for frame in frames)
        first, last = frames[0].pixels, frames[-1].pixels
        assert first.mean((0, 1)) == pytest.approx(last.mean((0, 1)), rel=0.25)

        supervisor.send(Pause(task))
        open_lens = arrays.camera.copy()
        open_lens["aperture_radius"] = 0.1
        supervisor.send(Update(task, 3, edit=SceneEdit(camera=open_lens), base=2))
        supervisor.send(Want(task, 300, View(encoding="linear")))
        while (only := await ears.next_of(task, Frame, Loaded)).generation != 3:
            pass
        # On a slow machine at less than full resolution, and there is no other one.
        assert isinstance(only, Frame) and not only.provisional, "at rest one first look is all it wants"
        assert not supervisor.statistics.restarts

    with_supervisor(test, ahead="some")
