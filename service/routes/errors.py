"""Every error as an `application/problem+json` answer (RFC 9457)."""

from __future__ import annotations

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect
from starlette.responses import JSONResponse, Response
from starlette.routing import Match, Mount

from service.problems import FieldError, InvalidDocument, ServiceError, Unauthorized, answer, problem

MEDIA_TYPE = "application/problem+json"
GONE = 499  # nginx's status, for logs and metrics, of a request whose sender went away; nobody receives it


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
    assert isinstance(error, HTTPException)
    headers = {"allow": _allowed(request)} if error.status_code == 405 else error.headers
    body = {
        "type": "about:blank",
        "title": error.detail,
        "status": error.status_code,
        "detail": f"{request.method} {request.url.path}: {error.detail}",
    }
    return JSONResponse(body, error.status_code, headers, MEDIA_TYPE)


def _allowed(request: Request) -> str:
    """Every method that the address allows; the framework names those of one route."""

    def fits(method: str) -> bool:
        asked = {**request.scope, "method": method}
        routes = (route for route in request.app.router.routes if not isinstance(route, Mount))
        return any(route.matches(asked)[0] is Match.FULL for route in routes)

    methods = {method for method in ("DELETE", "GET", "POST", "PUT") if fits(method)} or {"GET"}
    return ", ".join(sorted(methods | {"HEAD"} if "GET" in methods else methods))
