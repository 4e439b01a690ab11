"""A scene in a notebook: its picture is live, edits by hand and in Python meet in one document."""

from __future__ import annotations

import asyncio
import base64
import contextlib
from importlib.resources import files as resources
from io import BytesIO
from typing import Any
from urllib.parse import quote

try:
    import anywidget
    import traitlets
except ImportError:
    raise ImportError(
        "View needs anywidget, which an extra brings along: pip install './client[notebook]' in a checkout of Sunbox"
    ) from None

from sunbox.client import post, run
from sunbox.errors import SunboxError
from sunbox.files import Folders, Scene
from sunbox.frames import Frame
from sunbox.live import LivePicture
from sunbox.merge import difference, merged
from sunbox.transport import Transport

PRESETS = ("scenes", "materials", "environments")
SIZE = {"width": 480, "height": 360}
SAVED_SAMPLES = 16  # that the picture in a saved notebook has, where they come soon
SAVED_WITHIN_S = 1.0


def _text(name: str) -> str:
    return resources("sunbox").joinpath("widget").joinpath(name).read_text("utf-8")


class View(anywidget.AnyWidget):
    """The live picture of a scene, with a hand on its camera and on the parameters of its materials.

    `view.scene` is the document as the server has it: assign another one, or change it by `update`, and the picture
    follows. After an edit by hand it is another one, of which `view.observe(f, "scene")` tells. What is refused
    raises Refused, with the pointer of the field, and changes nothing. `view.material` is the name of the chosen
    material.

    `settings` are those of a render: width, height, max_samples, quality and the others. Scenes and frames go through
    the kernel, so that it alone has to reach the server. `asset_root` is as of `Client`. Raises SunboxError.
    """

    _esm, _css = _text("widget.js"), _text("widget.css")
    scene = traitlets.Dict()
    material = traitlets.Unicode().tag(sync=True)

    def __init__(
        self,
        scene: Any,
        url: str | None = None,
        *,
        key: str | None = None,
        asset_root: Folders = (),
        **settings: Any,
    ) -> None:
        self._is_closed = False
        self._known: Scene | None = None  # a document that is on its way into `scene`, and that the server has
        self._transport = Transport(url, key, asset_root=asset_root)
        self._live = LivePicture(self._transport, scene, self, "jpeg", SIZE | settings)
        self._about = run(self._begun())
        super().__init__()
        self._accept(self._live.scene)
        self.on_msg(self._heard)

    @property
    def samples(self) -> int:
        """Samples of the newest frame, per pixel."""
        return self._frame.samples

    @property
    def noise(self) -> float | None:
        """Estimated RMSE of the luminance over its mean; None before 2 samples."""
        return self._frame.noise

    def update(self, patch: dict[str, Any]) -> None:
        """Changes the scene by a merge patch: `{"materials": {"ball": {"roughness": 0.2}}}`."""
        self.scene = merged(self.scene, patch)

    def wait(self, samples: int) -> None:
        """Returns when the picture has so many samples a pixel, or is done."""
        run(self._live.reached(samples=samples))

    def png(self) -> bytes:
        """The newest frame as a file."""
        file = BytesIO()
        self._frame.image().save(file, "png")
        return file.getvalue()

    def close(self) -> None:
        """Ends the stream and takes the widget away."""
        super().close()
        if not self._is_closed:
            self._is_closed = True
            with contextlib.suppress(RuntimeError):  # the process ends, and the stream with it
                post(self._ended())

    def _repr_mimebundle_(self, **options: Any) -> Any:
        """The widget, and beside it a picture for where there is none, such as a saved notebook."""
        shown = super()._repr_mimebundle_(**options)
        if shown is None:
            return None
        run(self._soon())
        data, metadata = shown
        return {**data, "image/png": base64.b64encode(self.png()).decode()}, metadata

    @property
    def _frame(self) -> Frame:
        frame = self._live.frame
        assert frame is not None, "a view begins with one"
        return frame

    @traitlets.validate("scene")
    def _taken(self, proposal: Any) -> Any:
        """The document as the server has taken it. Raises SunboxError where it does not."""
        if proposal.value is self._known:
            return proposal.value
        before = self._live.scene
        document = run(self._changed(proposal.value))
        self._show(document, is_home=before["camera"] != document["camera"])
        return document

    @traitlets.observe("scene")
    def _choose(self, change: Any) -> None:
        if self.material not in change.new["materials"]:
            self.material = next(iter(change.new["materials"]), "")

    def _accept(self, scene: Scene) -> None:
        """Takes a document that the server has already."""
        self._known = scene
        try:
            self.scene = scene
        finally:
            self._known = None

    def _heard(self, _: Any, message: dict[str, Any], buffers: Any) -> None:
        """From the front end, which may be heard on a thread of its own."""
        kind, who = message.get("type"), message.get("view", "")
        if kind == "hello":
            self._say("begin", view=who, scene=_light(self.scene), **self._about)
            post(self._live.look(who))
        elif kind == "ack":
            post(self._seen(message["seq"]))
        elif kind == "edit":
            post(self._edited(message["patch"]))
            self._accept(merged(self.scene, message["patch"]))
            self._say("taken", view=who, number=message["number"])
            self._show(self.scene, but=who)
        elif kind == "preset" and message["kind"] in PRESETS:
            self._take_preset(message["kind"], message["name"])
        elif kind == "seen":
            post(self._live.look(who))
        elif kind == "unseen":
            post(self._live.look_away(who))

    def _take_preset(self, kind: str, name: str) -> None:
        """A built-in document: a scene for the scene, an environment or a material in the place of its own."""
        try:
            document = run(self._transport.json("GET", f"/v1/presets/{kind}/{quote(name, safe='')}"))
        except SunboxError as error:
            return self.ended(error)
        scene = self.scene
        if kind == "environments":
            document = {**scene, "environment": document}
        elif kind == "materials":
            shown = document.get("textures", {})
            if "materials" in document:  # one that comes with its textures
                (document,) = document["materials"].values()
            document = {**scene, "materials": {**scene["materials"], self.material: document}}
            if shown:
                document["textures"] = {**scene.get("textures", {}), **shown}
        if (patch := difference(scene, document)) is not None:
            post(self._edited(patch))
            self._accept(document)
            self._show(document, is_home=kind == "scenes")

    def _show(self, scene: Scene, **more: Any) -> None:
        self._say("scene", scene=_light(scene), **more)

    def _say(self, kind: str, **more: Any) -> None:
        self.send({"type": kind, **more})

    # From here on all is called on the loop of the picture.

    async def _begun(self) -> dict[str, Any]:
        """The schema and the presets, which the front end has to know."""
        try:
            await self._live.begin()
            presets = {kind: await self._transport.json("GET", f"/v1/presets/{kind}") for kind in PRESETS}
            return {"schema": (await self._transport.json("GET", "/v1/schema"))["scene"], "presets": presets}
        except BaseException:
            self._is_closed = True
            await self._ended()
            raise

    async def _ended(self) -> None:
        await self._live.close()
        await self._transport.close()

    async def _changed(self, scene: Any) -> Scene:
        patch = difference(self._live.scene, await self._transport.uploaded(scene))
        if patch is not None:
            await self._live.reached(await self._live.change(patch))
        return self._live.scene

    async def _edited(self, patch: dict[str, Any]) -> None:
        try:
            await self._live.change(patch)
        except SunboxError as error:
            self.ended(error)

    async def _seen(self, seq: int) -> None:
        self._live.seen(seq)

    async def _soon(self) -> None:
        """When there are samples enough for a picture that is kept, or that takes too long."""
        with contextlib.suppress(TimeoutError, SunboxError):
            async with asyncio.timeout(SAVED_WITHIN_S):
                await self._live.reached(samples=SAVED_SAMPLES)

    def framed(self, frame: Frame) -> None:
        header = {name: getattr(frame, name) for name in ("generation", "seq", "samples", "noise", "mime")}
        self.send({"type": "frame", **header}, [frame.data])

    def refused(self, error: SunboxError) -> None:
        self._accept(self._live.scene)
        place = (error.pointer or "").removeprefix("/scene")
        self._say("refused", scene=_light(self.scene), pointer=place, detail=str(error))

    def ended(self, error: SunboxError) -> None:
        self._say("refused", scene=_light(self.scene), pointer="", detail=str(error))


def _light(scene: Scene) -> Scene:
    """The document without its shapes, which may be large, and which the front end does not edit."""
    return {name: value for name, value in scene.items() if name != "shapes"}
