"""Compression of what everybody may read: the editor's files, the API's description, schemas and presets.

All else goes out as it is. Pictures do not get smaller, and the length of a compressed answer that holds a secret
beside text of a stranger's choice would tell of the secret (the attack is known as BREACH); these answers hold
neither.
"""

from __future__ import annotations

import gzip
import json
from typing import Any

from starlette.middleware.gzip import GZipMiddleware
from starlette.requests import HTTPConnection
from starlette.responses import Response
from starlette.types import ASGIApp, Receive, Scope, Send

from service.server.http.guard import route_path

PUBLIC_API = ("/v1/schema", "/v1/presets/")
LEVEL = 6  # 9 takes twice as long for 1 % less


class Constant:
    """JSON that everybody may read and that never changes: as text, and compressed."""

    def __init__(self, value: Any) -> None:
        self.plain = json.dumps(value, ensure_ascii=False, separators=(",", ":")).encode()
        self._compressed = gzip.compress(self.plain, LEVEL, mtime=0)

    def answer(self, request: HTTPConnection) -> Response:
        headers = {"vary": "Accept-Encoding"}
        if "gzip" not in request.headers.get("accept-encoding", ""):
            return Response(self.plain, headers=headers, media_type="application/json")
        headers["content-encoding"] = "gzip"
        return Response(self._compressed, headers=headers, media_type="application/json")


class Compressed:
    """ASGI middleware: gzip for clients that accept it."""

    def __init__(self, app: ASGIApp) -> None:
        self._app, self._gzip = app, GZipMiddleware(app, compresslevel=LEVEL)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        app = self._gzip if scope["type"] == "http" and _is_public(route_path(scope)) else self._app
        await app(scope, receive, send)


def _is_public(path: str) -> bool:
    return path.startswith(PUBLIC_API) if path.startswith("/v1/") else path != "/metrics"
