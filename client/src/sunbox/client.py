"""A server whose calls wait: `async_client` run on a loop of its own."""

from __future__ import annotations

import contextlib
from collections.abc import AsyncIterator, Iterator
from pathlib import Path
from types import TracebackType
from typing import Any, TypeVar

from numpy.typing import ArrayLike

from sunbox import files
from sunbox.async_batch import AsyncBatch
from sunbox.async_client import AsyncClient
from sunbox.async_job import AsyncJob, AsyncPicture, Pixels, Status
from sunbox.async_stream import AsyncStream
from sunbox.background import Background
from sunbox.exports import Exported
from sunbox.frames import Frame
from sunbox.lobes import Albedo, Bsdf
from sunbox.transport import PATIENCE_S, TIMEOUT_S
from sunbox.verdicts import Verdict

T = TypeVar("T")
_background = Background()  # of all clients: one loop, one thread
run, post = _background.run, _background.post


class Client:
    """The calls of `AsyncClient`, which has their documentation, without `await`; a context manager, too."""

    def __init__(
        self, url: str | None = None, key: str | None = None, timeout: float = TIMEOUT_S,
        patience: float = PATIENCE_S, asset_root: files.Folders = (),
    ) -> None:  # fmt: skip
        self._client = AsyncClient(url, key, timeout, patience, asset_root)

    @property
    def url(self) -> str:
        return self._client.url

    def __enter__(self) -> Client:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        run(self._client.close())

    def render(self, scene: Any, progress: bool | None = None, **settings: Any) -> Picture:
        """The picture of a scene: a dict, or a path to its JSON file. Ctrl-C cancels the render."""
        return Picture(run(self._client.render(scene, progress, **settings)))

    def submit(
        self,
        scene: Any,
        label: str | None = None,
        priority: int = 0,
        idempotency_key: str | None = None,
        callback: str | None = None,
        **settings: Any,
    ) -> Job:
        """A render that goes on by itself, also when this program has ended."""
        return Job(run(self._client.submit(scene, label, priority, idempotency_key, callback, **settings)))

    def batch(
        self,
        scene: Any,
        over: Any,
        label: str | None = None,
        priority: int = 0,
        idempotency_key: str | None = None,
        callback: str | None = None,
        **settings: Any,
    ) -> Batch:
        """Renders of a scene that varies along axes, which go on when this program has ended."""
        return Batch(run(self._client.batch(scene, over, label, priority, idempotency_key, callback, **settings)))

    def batch_of(self, id: str) -> Batch:
        """A batch by its id; asks nothing."""
        return Batch(self._client.batch_of(id))

    def job(self, id: str) -> Job:
        """A render by its id; asks nothing."""
        return Job(self._client.job(id))

    def jobs(self, label: str | None = None, state: str | None = None) -> Iterator[Job]:
        """One's own renders, the newest first."""
        return map(Job, _each(self._client.jobs(label, state)))

    def statuses(
        self, label: str | None = None, state: str | None = None, limit: int | None = None
    ) -> Iterator[Status]:
        """The statuses of one's own renders, the newest first, at most `limit`."""
        return _each(self._client.statuses(label, state, limit))

    def stream(self, scene: Any, format: str = "rgba32f", **settings: Any) -> Stream:
        """A context manager and iterator of frames, each better than the one before."""
        return Stream(self._client.stream(scene, format, **settings))

    def compare(self, a: Any, b: Any, confidence: float = 0.999, map: str | None = None, **settings: Any) -> Verdict:
        """A verdict on whether two scenes, renders, pictures or EXR files differ. Ctrl-C ends the work."""
        return run(self._client.compare(a, b, confidence, map, **settings))

    def upload(self, file: str | Path | bytes, name: str = "", entry: str | None = None) -> str:
        """The id of a file on the server, or of one model of a zip; a content is sent once."""
        return run(self._client.upload(file, name, entry))

    def import_scene(
        self, path: str | Path, variant: str | None = None, animation: str | None = None, time: float | None = None,
        entry: str | None = None,
    ) -> files.Scene:  # fmt: skip
        """A model's file (GLB, a zip of a model with its parts) as a scene's document, perhaps in a pose."""
        return run(self._client.import_scene(path, variant, animation, time, entry))

    def describe(self, path: str | Path) -> dict[str, Any]:
        """The description of a file; of a scene with its `variants` and `animations`."""
        return run(self._client.describe(path))

    def export(self, scene: Any, format: str = "glb") -> Exported:
        """A scene as a file for other programs: its `data`, and what is `lost`."""
        return run(self._client.export(scene, format))

    def bsdf(self, material: dict[str, Any], wo: ArrayLike, wi: ArrayLike) -> Bsdf:
        """A material's BSDF for directions `wo`, (n, 3), and `wi`, (m, 3), in the shading frame: z is the normal."""
        return run(self._client.bsdf(material, wo, wi))

    def albedo(self, material: dict[str, Any], cosines: ArrayLike, samples: int = 4096) -> Albedo:
        """Directional albedo for each cosine in (0, 1] of the angle to the normal."""
        return run(self._client.albedo(material, cosines, samples))

    def presets(self, kind: str) -> list[str]:
        """The names of the built-in `scenes`, `materials` or `environments`."""
        return run(self._client.presets(kind))

    def preset(self, kind: str, name: str) -> dict[str, Any]:
        """A built-in document."""
        return run(self._client.preset(kind, name))

    def documents(self, kind: str) -> list[str]:
        """The names of saved `scenes` or `materials`: one's own, and those that others share."""
        return run(self._client.documents(kind))

    def document(self, kind: str, name: str) -> dict[str, Any]:
        """A saved document."""
        return run(self._client.document(kind, name))

    def save(self, kind: str, name: str, document: Any, shared: bool | None = None, by_link: bool = False) -> None:
        """Saves a scene or a material under a name, in the place of one's own of that name."""
        run(self._client.save(kind, name, document, shared, by_link))

    def delete_document(self, kind: str, name: str) -> None:
        """Deletes a saved document."""
        run(self._client.delete_document(kind, name))

    def info(self) -> dict[str, Any]:
        """The server's version, renderers, limits and quality presets."""
        return run(self._client.info())

    def schema(self) -> dict[str, Any]:
        """The JSON schemas of `scene` and `settings`."""
        return run(self._client.schema())


class Job:
    """The calls of `AsyncJob` without `await`."""

    def __init__(self, job: AsyncJob) -> None:
        self._job = job

    @property
    def id(self) -> str:
        return self._job.id

    def __repr__(self) -> str:
        return f"Job({self.id!r})"

    def status(self) -> Status:
        """`state` is queued, running, done, cancelled or failed."""
        return run(self._job.status())

    def events(self) -> Iterator[Status]:
        """The status whenever it changes; the last is that of the end."""
        return _each(self._job.events())

    def result(self, progress: bool | None = None) -> Picture:
        """The picture at the end. Ctrl-C cancels the render."""
        return Picture(run(self._job.result(progress)))

    def picture(self) -> Picture:
        """The picture so far."""
        return Picture(run(self._job.picture()))

    def cancel(self) -> None:
        """Ends it; the picture so far stays."""
        run(self._job.cancel())

    def delete(self) -> None:
        """Ends it where it goes on, and deletes its picture."""
        run(self._job.delete())


class Batch:
    """The calls of `AsyncBatch`, which has their documentation, without `await`."""

    def __init__(self, batch: AsyncBatch) -> None:
        self._batch = batch

    @property
    def id(self) -> str:
        return self._batch.id

    def __repr__(self) -> str:
        return f"Batch({self.id!r})"

    def status(self, wait: float = 0) -> Status:
        """`state`, `counts` by state, `renders` with the id and state of each, `eta_s`."""
        return run(self._batch.status(wait))

    def wait(self, progress: bool | None = None) -> Status:
        """The status at the end. Ctrl-C cancels the batch."""
        return run(self._batch.wait(progress))

    def pictures(self, progress: bool | None = None) -> list[Picture]:
        """All pictures at the end, in their order. Ctrl-C cancels the batch."""
        return [Picture(each) for each in run(self._batch.pictures(progress))]

    def as_completed(self) -> Iterator[tuple[int, Picture]]:
        """Place and picture of each render, as soon as it is done."""
        for place, picture in _each(self._batch.as_completed()):
            yield place, Picture(picture)

    def sheet(self, format: str = "png", width: int | None = None, **view: Any) -> bytes:
        """A contact sheet of what there is: png, jpeg or webp."""
        return run(self._batch.sheet(format, width, **view))

    def animation(self, format: str = "apng", fps: float = 24, width: int | None = None, **view: Any) -> bytes:
        """The pictures that there are, one after the other: apng, webp, gif, avif or mp4."""
        return run(self._batch.animation(format, fps, width, **view))

    def zip(self, format: str = "png", **view: Any) -> bytes:
        """A zip of all pictures that there are."""
        return run(self._batch.zip(format, **view))

    def save_sheet(self, path: str | Path, width: int | None = None, **view: Any) -> None:
        """The contact sheet in the format of the path's ending."""
        run(self._batch.save_sheet(path, width, **view))

    def save_animation(self, path: str | Path, fps: float = 24, width: int | None = None, **view: Any) -> None:
        """The animation in the format of the path's ending; .png is an APNG."""
        run(self._batch.save_animation(path, fps, width, **view))

    def cancel(self) -> None:
        """Ends it; the pictures so far stay."""
        run(self._batch.cancel())

    def delete(self) -> None:
        """Ends it where it goes on, and deletes it with its pictures."""
        run(self._batch.delete())


class Picture:
    """A picture that is fetched as it is asked for; a notebook shows it. See `AsyncPicture`."""

    def __init__(self, picture: AsyncPicture) -> None:
        self._picture = picture

    @property
    def id(self) -> str | None:
        return self._picture.id

    @property
    def samples(self) -> int:
        return self._picture.samples

    @property
    def noise(self) -> float | None:
        return self._picture.noise

    @property
    def warnings(self) -> list[str]:
        return self._picture.warnings

    @property
    def settings(self) -> dict[str, Any]:
        return self._picture.settings

    @property
    def status(self) -> Status:
        return self._picture.status

    def numpy(self) -> Pixels:
        """(height, width, 4) linear float32, premultiplied by alpha; row 0 is the top."""
        return run(self._picture.numpy())

    def aov(self, name: str) -> Pixels:
        """(height, width, channels): `albedo`, `normal` and `variance` have 3, `depth` 1, `color` 4."""
        return run(self._picture.aov(name))

    def exr(self) -> bytes:
        """An OpenEXR file with the colour and every AOV as layers."""
        return run(self._picture.exr())

    def png(self, **view: Any) -> bytes:
        """As on a screen. `view`: bits, exposure, tone_map, color_space, lut, aov."""
        return run(self._picture.png(**view))

    def save(self, path: str | Path, **view: Any) -> None:
        """A file in the format of its ending: .png, .jpg, .webp, .avif, .exr, .hdr or .npy."""
        run(self._picture.save(path, **view))

    def fetch(self, format: str, **view: Any) -> bytes:
        """The bytes of a file: png, jpeg, webp, avif, exr, hdr or npy."""
        return run(self._picture.fetch(format, **view))

    def _repr_png_(self) -> bytes:
        return self.png()

    def __repr__(self) -> str:
        noise = "" if self.noise is None else f", {self.noise:.1%} noise"
        return f"<Picture {self.settings['width']} x {self.settings['height']}, {self.samples} samples{noise}>"


class Stream:
    """A context manager and iterator of frames; see `AsyncStream`."""

    def __init__(self, stream: AsyncStream) -> None:
        self._stream = stream

    @property
    def generation(self) -> int:
        """The number of the last update."""
        return self._stream.generation

    @property
    def done(self) -> dict[str, Any] | None:
        """Why the picture is done, with its samples and noise; None before."""
        return self._stream.done

    @property
    def scene(self) -> files.Scene:
        """The document with all updates."""
        return self._stream.scene

    def __enter__(self) -> Stream:
        run(self._stream.__aenter__())
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        run(self._stream.__aexit__(kind, error, trace))

    def __iter__(self) -> Stream:
        return self

    def __next__(self) -> Frame:
        try:
            return run(self._stream.__anext__())
        except StopAsyncIteration:
            raise StopIteration from None

    def update(self, patch: dict[str, Any] | None = None, **settings: Any) -> None:
        """Changes the scene by a merge patch, and settings by their names."""
        run(self._stream.update(patch, **settings))

    def view(self, **view: Any) -> None:
        """How frames look: format, quality, exposure, tone_map, color_space, lut, aov, max_fps, bits, prior."""
        run(self._stream.view(**view))

    def pause(self) -> None:
        run(self._stream.pause())

    def resume(self) -> None:
        run(self._stream.resume())


def _each(items: AsyncIterator[T]) -> Iterator[T]:
    """The items as they come; whoever stops early ends what makes them."""
    try:
        while True:
            try:
                yield run(_next(items))
            except StopAsyncIteration:
                return
    finally:
        if (close := getattr(items, "aclose", None)) is not None:
            with contextlib.suppress(RuntimeError):
                run(close())


async def _next(items: AsyncIterator[T]) -> T:
    return await anext(items)
