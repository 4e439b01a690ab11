"""The scenes that agents work on: documents, or names of saved ones, and nothing from their own machine."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from typing import Any
from urllib.parse import quote

from sunbox import files
from sunbox.agent_answers import Mistake
from sunbox.errors import NotFound, Refused
from sunbox.merge import merged
from sunbox.transport import Transport

NAME_DIGITS = 24  # of the hash of a document, which names it
NO_FILES = "is not the id of an asset (sha256:...): files and URLs are not read here"

Scene = dict[str, Any]


class AgentScenes:
    """Scenes on a server. Nothing is read from this machine: the transport's uploads are not used."""

    def __init__(self, transport: Transport) -> None:
        self._transport = transport

    async def document(self, scene: Scene | str, argument: str = "scene") -> Scene:
        """The document; of a name, the one that is saved or built in. Raises Mistake, SunboxError."""
        if isinstance(scene, dict):
            refuse_files(scene, f"/{argument}")
            return scene
        return await self._named("scenes", scene, argument)

    async def material(self, material: Scene | str) -> Scene:
        """A material's document; of a name, the one that is built in or saved. Raises Mistake, SunboxError."""
        if isinstance(material, str):
            material = await self._named("materials", material, "material")
            (material,) = material.get("materials", {"": material}).values()
        refuse_files(material, "/material")
        return material

    async def patched(self, scene: Scene | str, patch: Scene) -> str:
        """The name of a scene with a merge patch. Raises Mistake, SunboxError."""
        return await self.saved(merged(await self.document(scene), patch))

    async def saved(self, document: Scene) -> str:
        """The name of a document, which is saved: whoever knows the name may read it, and it is deleted when nobody
        has read it for 90 days. Equal documents have one name. Raises Mistake, Refused."""
        refuse_files(document, "/scene")
        name = f"scene-{hashlib.sha256(files.text(document).encode()).hexdigest()[:NAME_DIGITS]}"
        try:
            await self._transport.json("PUT", f"/v1/documents/scenes/{name}?by_link=true", document)
        except Refused as error:
            error.errors = [(f"/scene{pointer}", detail) for pointer, detail in error.errors]
            raise
        return name

    async def _named(self, kind: str, name: str, argument: str) -> Scene:
        if not name or any(letter in name for letter in "/\\:"):
            detail = "is neither a document nor the name of a saved one; files and URLs are not read here"
            raise Mistake(f"/{argument}", detail)
        for place in (f"/v1/documents/{kind}", f"/v1/presets/{kind}"):
            try:
                return dict(await self._transport.json("GET", f"{place}/{quote(name, safe='')}"))
            except NotFound:
                continue
        known = [each["name"] for each in await self._transport.json("GET", f"/v1/presets/{kind}")]
        detail = f"is not the name of one that is saved, nor of one that is built in: {', '.join(known)}"
        raise Mistake(f"/{argument}", detail)


def refuse_files(document: Any, pointer: str) -> None:
    """Raise Mistake where a document names an asset by anything but its id."""
    for where, value in _assets(document, pointer):
        if not isinstance(value, str) or not value.startswith(files.UPLOADED):
            raise Mistake(where, NO_FILES)


def _assets(value: Any, pointer: str) -> Iterator[tuple[str, Any]]:
    """The entries of `asset` and `assets`, with their pointers. A material may have such a name, but is an object."""
    steps = enumerate(value) if isinstance(value, list) else value.items() if isinstance(value, dict) else ()
    for step, child in steps:
        where = f"{pointer}/{str(step).replace('~', '~0').replace('/', '~1')}"
        if isinstance(child, dict | list):
            faces = child.items() if step == "assets" and isinstance(child, dict) else ()
            yield from ((f"{where}/{name}", each) for name, each in faces if not isinstance(each, dict | list))
            yield from _assets(child, where)
        elif step == "asset":
            yield where, child
