"""A server to `await`: scenes in, pictures out."""

from __future__ import annotations

import asyncio
import uuid
from collections.abc import AsyncIterator
from pathlib import Path
from types import TracebackType
from typing import Any
from urllib.parse import quote, urlencode

import numpy as np
from numpy.typing import ArrayLike

from sunbox import exports, files, lobes, verdicts
from sunbox.async_batch import AsyncBatch
from sunbox.async_job import AsyncJob, AsyncPicture
from sunbox.async_stream import AsyncStream
from sunbox.files import Folders
from sunbox.transport import PATIENCE_S, TIMEOUT_S, Transport

PAGE = 200


class AsyncClient:
    """`url` and `key` come from SUNBOX_URL and SUNBOX_API_KEY, the address else is http://127.0.0.1:8000. `timeout`:
    seconds without a byte. `patience`: for how many seconds a request is sent again where the server is full, ends or
    starts; a restart takes less than the default. An address where nothing has ever answered is given up after 5.

    A scene is a dict as the service's documentation has it, or a path to its JSON file. Numpy arrays may stand for
    lists; files may be named by path (in a dict relative to the working directory, in a file to its folder) and are
    uploaded once. They lie in that folder, or in one of `asset_root`: whoever wrote a document has no others sent.
    Every call raises SunboxError where the server refuses or cannot.
    """

    def __init__(
        self,
        url: str | None = None,
        key: str | None = None,
        timeout: float = TIMEOUT_S,
        patience: float = PATIENCE_S,
        asset_root: Folders = (),
    ) -> None:
        self._transport = Transport(url, key, timeout, patience, asset_root)

    @property
    def url(self) -> str:
        return self._transport.url

    async def __aenter__(self) -> AsyncClient:
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        await self.close()

    async def close(self) -> None:
        await self._transport.close()

    async def render(self, scene: Any, progress: bool | None = None, **settings: Any) -> AsyncPicture:
        """The picture of a scene. `settings`: width, height, max_samples, quality and the others. Cancelled, it
        cancels the render. `progress`: None shows a line in a terminal and in a notebook."""
        job = asyncio.ensure_future(self.submit(scene, **settings))
        try:
            return await (await asyncio.shield(job)).result(progress)
        except asyncio.CancelledError:
            if not job.done():  # the server may have it already
                await (await job).cancel()
            raise

    async def submit(
        self,
        scene: Any,
        label: str | None = None,
        priority: int = 0,
        idempotency_key: str | None = None,
        callback: str | None = None,
        **settings: Any,
    ) -> AsyncJob:
        """A render that goes on by itself. `label`: up to 200 characters to find it by; `priority`: -10 to 10 among
        one's own; `idempotency_key`: the same key with the same request gives the same render within a day;
        `callback`: a URL that the server posts to at its end, where its operator allows the host."""
        document = await self._transport.uploaded(scene)
        body = {"scene": document, "settings": settings, "priority": priority} | _given(label, callback)
        key = {"idempotency-key": idempotency_key or uuid.uuid4().hex}  # so that it may be sent twice
        return AsyncJob(self._transport, (await self._transport.json("POST", "/v1/renders", body, key))["id"])

    async def batch(
        self,
        scene: Any,
        over: Any,
        label: str | None = None,
        priority: int = 0,
        idempotency_key: str | None = None,
        callback: str | None = None,
        **settings: Any,
    ) -> AsyncBatch:
        """Renders of a scene that varies along axes. `over`: a list of axes, `{"path": "/materials/a/roughness",
        "values": [...]}`, `{"patches": [...], "names": [...]}`, `{"turntable": n, "degrees": 360}` or
        `{"time": [...], "asset": id, "animation": name}` of an uploaded glTF file; they multiply, and the last runs
        fastest. Or a dict of paths and values, an axis for each. The others as of `submit`."""
        axes = [{"path": path, "values": values} for path, values in over.items()] if isinstance(over, dict) else over
        body = {"scene": await self._transport.uploaded(scene), "settings": settings, "over": axes}
        body |= {"priority": priority} | _given(label, callback)
        key = {"idempotency-key": idempotency_key or uuid.uuid4().hex}
        return AsyncBatch(self._transport, (await self._transport.json("POST", "/v1/batches", body, key))["id"])

    def batch_of(self, id: str) -> AsyncBatch:
        """A batch by its id; asks nothing."""
        return AsyncBatch(self._transport, id)

    def job(self, id: str) -> AsyncJob:
        """A render by its id; asks nothing."""
        return AsyncJob(self._transport, id)

    async def jobs(self, label: str | None = None, state: str | None = None) -> AsyncIterator[AsyncJob]:
        """One's own renders, the newest first."""
        async for status in self.statuses(label, state):
            yield AsyncJob(self._transport, status["id"])

    async def statuses(
        self, label: str | None = None, state: str | None = None, limit: int | None = None
    ) -> AsyncIterator[dict[str, Any]]:
        """The statuses of one's own renders, the newest first, at most `limit`."""
        left = limit
        query: dict[str, Any] = {}
        query |= {name: value for name, value in (("label", label), ("state", state)) if value is not None}
        while left is None or left > 0:
            query["limit"] = PAGE if left is None else min(left, PAGE)
            page = await self._transport.json("GET", f"/v1/renders?{urlencode(query)}")
            for each in page:
                yield each
            if len(page) < query["limit"]:
                return
            query["after"] = page[-1]["id"]
            left = None if left is None else left - len(page)

    def stream(self, scene: Any, format: str = "rgba32f", **settings: Any) -> AsyncStream:
        """A context manager and iterator of frames, each better than the one before. `format`: rgba32f, png, jpeg or
        webp."""
        return AsyncStream(self._transport, scene, format, settings)

    async def compare(
        self, a: Any, b: Any, confidence: float = 0.999, map: str | None = None, **settings: Any
    ) -> verdicts.Verdict:
        """A verdict on whether two pictures differ. Each side is a scene, `{"scene": ..., "settings": ...}`, a render
        (a job or its id), or an EXR file with every layer (its path, or its id on the server). Scenes are rendered
        with the same seeds, up to the `max_samples` of their settings, to which `settings` are added. `map`: p,
        difference, flip or heat also brings a picture of where they differ. Cancelled, it ends the work."""
        return await verdicts.compare(self._transport, a, b, confidence, map, settings)

    async def upload(self, file: str | Path | bytes, name: str = "", entry: str | None = None) -> str:
        """The id of a file on the server, from its path or its bytes; `name` tells how bytes are to be read
        ("chair.obj"). A content is sent once. `entry` takes one of several models of a zip, by its name there."""
        if isinstance(file, bytes):
            return await self._transport.upload(file, name, entry)
        return await self._transport.upload_file(Path(file), entry)

    async def import_scene(
        self, path: str | Path, variant: str | None = None, animation: str | None = None, time: float | None = None,
        entry: str | None = None,
    ) -> files.Scene:  # fmt: skip
        """A model's file (GLB, a zip of a model and its parts) as a scene's document: as it was saved, or with one of
        its material variants, or as one of its animations has it at `time` (s). `describe` lists both. `entry` as for
        `upload`."""
        chosen = {"variant": variant, "animation": animation, "time": time}
        query = urlencode({name: value for name, value in chosen.items() if value is not None})
        id = await self.upload(path, entry=entry)
        return dict(await self._transport.json("GET", f"/v1/assets/{id}/scene?{query}"))

    async def describe(self, path: str | Path) -> dict[str, Any]:
        """The description of a file: kind, size, warnings; of a scene `variants` and `animations` (name, duration),
        too."""
        id = await self.upload(path)
        return dict(await self._transport.json("GET", f"/v1/assets/{id}", headers={"accept": "application/json"}))

    async def export(self, scene: Any, format: str = "glb") -> exports.Exported:
        """A scene as a file for other programs: its bytes, and what its format has no place for."""
        return await exports.export(self._transport, scene, format)

    async def bsdf(self, material: dict[str, Any], wo: ArrayLike, wi: ArrayLike) -> lobes.Bsdf:
        """A material's BSDF for each of n directions `wo`, (n, 3), and m directions `wi`, (m, 3), in the shading
        frame: z is the normal, x the tangent. Any number of them: more than a request takes go in several."""
        out, into = lobes.directions(wo, "/wo"), lobes.directions(wi, "/wi")
        f, pdf = np.empty((len(out), len(into), 3)), np.empty((len(out), len(into)))
        delta: list[list[lobes.SpecularLobe]] = [[] for _ in out]
        for rows, columns in lobes.tiles(out, into):
            body = {"material": material, "wo": out[rows], "wi": into[columns]}
            answer = await self._transport.json("POST", "/v1/bsdf", body)
            f[rows, columns], pdf[rows, columns] = answer["f"], answer["pdf"]
            delta[rows] = lobes.specular(answer["delta"])
        return lobes.Bsdf(f, pdf, delta)

    async def albedo(self, material: dict[str, Any], cosines: ArrayLike, samples: int = 4096) -> lobes.Albedo:
        """Directional albedo for each cosine in (0, 1] of the angle to the normal."""
        body = {"material": material, "cosines": np.atleast_1d(np.asarray(cosines, float)), "samples": samples}
        answer = await self._transport.json("POST", "/v1/bsdf/albedo", body)
        return lobes.Albedo(np.asarray(answer["albedo"]), np.asarray(answer["error"]))

    async def presets(self, kind: str) -> list[str]:
        """The names of the built-in `scenes`, `materials` or `environments`."""
        return [each["name"] for each in await self._transport.json("GET", f"/v1/presets/{quote(kind, safe='')}")]

    async def preset(self, kind: str, name: str) -> dict[str, Any]:
        """A built-in document."""
        return dict(await self._transport.json("GET", f"/v1/presets/{quote(kind, safe='')}/{quote(name, safe='')}"))

    async def documents(self, kind: str) -> list[str]:
        """The names of saved `scenes` or `materials`: one's own, and those that others share."""
        names: list[str] = []
        while True:
            query = urlencode({"limit": PAGE} | ({"after": max(names)} if names else {}))
            page = await self._transport.json("GET", f"{_saved(kind)}?{query}")
            names += [each["name"] for each in page]
            if len(page) < PAGE:
                return names

    async def document(self, kind: str, name: str) -> dict[str, Any]:
        """A saved document."""
        return dict(await self._transport.json("GET", _saved(kind, name)))

    async def save(
        self, kind: str, name: str, document: Any, shared: bool | None = None, by_link: bool = False
    ) -> None:
        """Saves a scene or a material under a name, in the place of one's own of that name. `shared`: others may read
        it and see it listed; `by_link`: whoever knows the name may read it."""
        query = {"shared": str(shared).lower()} if shared is not None else {}
        query |= {"by_link": "true"} if by_link else {}
        body = await self._transport.uploaded(document, "")
        await self._transport.json("PUT", f"{_saved(kind, name)}?{urlencode(query)}", body)

    async def delete_document(self, kind: str, name: str) -> None:
        """Deletes a saved document."""
        await self._transport.json("DELETE", _saved(kind, name))

    async def info(self) -> dict[str, Any]:
        """The server's version, renderers, limits and quality presets."""
        return dict(await self._transport.json("GET", "/v1/info"))

    async def schema(self) -> dict[str, Any]:
        """The JSON schemas of `scene` and `settings`."""
        return dict(await self._transport.json("GET", "/v1/schema"))


def _saved(*steps: str) -> str:
    return "/v1/documents/" + "/".join(quote(step, safe="") for step in steps)


def _given(label: str | None, callback: str | None) -> dict[str, str]:
    """The members of a request that are not null."""
    return {name: value for name, value in (("label", label), ("callback", callback)) if value is not None}
