"""Every error as an `application/problem+json` answer (RFC 9457)."""

from __future__ import annotations

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect
from starlette.responses import JSONResponse, Response
from starlette.routing import Match, Mount
from starlette.staticfiles import StaticFiles
from starlette.types import Scope

from service.problems import FieldError, InvalidDocument, ServiceError, Unauthorized, answer, problem

MEDIA_TYPE = "application/problem+json"
GONE = 499  # nginx's status for a request whose client went away; it appears only in logs and metrics


def respond(error: Exception) -> Response:
    retry_after = getattr(error, "retry_after", None)
    headers = {} if retry_after is None else {"retry-after": str(retry_after)}
    if isinstance(error, Unauthorized):
        headers["www-authenticate"] = "Bearer"
    return JSONResponse(problem(error), answer(error).status, headers, MEDIA_TYPE)


def tell_errors(app: FastAPI) -> None:
    """Make `app` answer every error in this form, the framework's own included."""
    app.add_exception_handler(ServiceError, _refused)
    app.add_exception_handler(RequestValidationError, _invalid)
    app.add_exception_handler(HTTPException, _unrouted)
    app.add_exception_handler(ClientDisconnect, _gone)
    app.add_exception_handler(Exception, _refused)


async def _refused(request: Request, error: Exception) -> Response:
    return respond(error)


async def _gone(request: Request, error: Exception) -> Response:
    """The client went away in the middle of its body, which is no error."""
    return Response(status_code=GONE)


async def _invalid(request: Request, error: Exception) -> Response:
    """Answer invalid parameters of the address; documents are not validated by FastAPI."""
    assert isinstance(error, RequestValidationError)
    # Not `input` nor `ctx`: they may hold NaN, which is no JSON.
    errors = [FieldError("/" + "/".join(map(str, e["loc"][1:])), e["msg"]) for e in error.errors()]
    return respond(InvalidDocument(errors))


async def _unrouted(request: Request, error: Exception) -> Response:
    """Answer a path that leads nowhere, by any method, and a method that a path does not take."""
    assert isinstance(error, HTTPException)
    status, title, headers = error.status_code, error.detail, error.headers
    if status in (404, 405) and (
        allowed := _allowed(request)
    ):  # the mount of files is tried after all routes and does not know their methods
        status, title, headers = 405, "Method Not Allowed", {"allow": ", ".join(allowed)}
    body = {
        "type": "about:blank",
        "title": title,
        "status": status,
        "detail": f"{request.method} {request.url.path}: {title}",
    }
    return JSONResponse(body, status, headers, MEDIA_TYPE)


def _allowed(request: Request) -> list[str]:
    """Every method that the routes of the address allow; none where it has no route."""

    def fits(method: str) -> bool:
        asked = {**request.scope, "method": method}
        routes = (route for route in request.app.router.routes if not isinstance(route, Mount))
        return any(route.matches(asked)[0] is Match.FULL for route in routes)

    methods = {method for method in ("DELETE", "GET", "POST", "PUT") if fits(method)}
    return sorted(methods | {"HEAD"} if "GET" in methods else methods)


class Files(StaticFiles):
    """A folder's files. A path without a file is not found, by any method."""

    async def get_response(self, path: str, scope: Scope) -> Response:
        if scope["method"] not in ("GET", "HEAD"):
            await super().get_response(path, {**scope, "method": "GET"})
        return await super().get_response(path, scope)
