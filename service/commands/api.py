"""Requests to a server's REST API, over the standard library: the command line needs no HTTP client of its own."""

from __future__ import annotations

import http.client
import json
import urllib.error
import urllib.request
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from http.client import HTTPResponse
from typing import Any
from urllib.parse import quote, urlencode, urlsplit

from service.commands import BadInput, Failed, health
from service.commands.configuration import configuration

TIMEOUT_S = 600.0  # longest wait for a byte; event streams send a comment every 15 s
WRONG = {400, 401, 403, 404, 409, 410, 413, 415, 422}  # statuses of a wrong request


class Api:
    """A server, by the address with which all of its routes begin."""

    def __init__(self, url: str | None) -> None:
        """Without `url`, the server at SUNBOX_HOST and SUNBOX_PORT. Requests carry the first SUNBOX_API_KEY. Raises
        BadInput."""
        config = configuration()
        self.url = (url or f"http://{_authority(config.host)}:{config.port}").rstrip("/")
        if urlsplit(self.url).scheme not in ("http", "https") or not urlsplit(self.url).netloc:
            raise BadInput(f"--server {url!r}: is not an address such as http://127.0.0.1:8000")
        self._headers = {"authorization": f"Bearer {config.api_key[0]}"} if config.api_key else {}

    def json(self, method: str, path: str, body: Any = None, headers: Mapping[str, str] | None = None) -> Any:
        """The answer's JSON; None where it has no body. `body` is sent as JSON."""
        with self.open(method, path, None if body is None else json.dumps(body).encode(), headers) as answer:
            data = answer.read()
        return json.loads(data) if data else None

    def page(self, path: str, **query: Any) -> tuple[list[Any], bool]:
        """A page of a list, and whether there is another one. Parameters that are None are left out of the query."""
        given = {name: value for name, value in query.items() if value is not None}
        with self.open("GET", f"{path}?{urlencode(given)}") as answer:
            return json.loads(answer.read()), 'rel="next"' in answer.headers.get("link", "")

    def upload(self, data: bytes, name: str) -> str:
        """Upload an asset and return its id."""
        kind = {"content-type": "application/octet-stream"}
        with self.open("POST", f"/v1/assets?filename={quote(name)}", data, kind) as answer:
            return str(json.loads(answer.read())["id"])

    def events(self, path: str) -> Iterator[tuple[str, Any]]:
        """The name and the data of each event, until the answer ends."""
        with self.open("GET", path) as answer:
            name = ""
            for line in answer:
                field, _, value = line.decode().rstrip("\n").partition(": ")
                if field == "event":
                    name = value
                elif field == "data":
                    yield name, json.loads(value)

    @contextmanager
    def open(
        self, method: str, path: str, data: bytes | None = None, headers: Mapping[str, str] | None = None
    ) -> Iterator[HTTPResponse]:
        """The answer to a request. Raises BadInput with the server's message where it refuses, Failed where it cannot
        answer or cannot be reached."""
        given = {"content-type": "application/json", **self._headers, **(headers or {})}
        request = urllib.request.Request(self.url + path, data, given, method=method)
        try:
            with urllib.request.urlopen(request, timeout=TIMEOUT_S) as answer:
                yield answer
        except urllib.error.HTTPError as error:
            refusal = BadInput if error.code in WRONG else Failed
            raise refusal(*_lines(error)) from None
        except (OSError, http.client.HTTPException) as error:
            reason = error.reason if isinstance(error, urllib.error.URLError) else error
            raise Failed(f"{self.url}: {reason or type(error).__name__}") from None


def _authority(host: str) -> str:
    reachable = health.reachable(host)
    return f"[{reachable}]" if ":" in reachable else reachable


def _lines(error: urllib.error.HTTPError) -> list[str]:
    """The server's error message, a line for each field."""
    try:
        problem = json.loads(error.read())
        return [f"{each['pointer'] or '/'}: {each['detail']}" for each in problem.get("errors", [])] or [
            f"{problem['title']}: {problem['detail']}"
        ]
    except (ValueError, KeyError, TypeError, OSError):  # a proxy's answer
        return [f"{error.url}: {error.code} {error.reason}"]
