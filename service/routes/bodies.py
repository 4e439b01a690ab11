"""Bodies that are JSON."""

from __future__ import annotations

from starlette.requests import Request

from service.problems import UnsupportedMedia

# The last three are what programs say who have not been told what they send (curl, urllib, fetch).
TAKEN = {"application/json", "text/json", "application/x-www-form-urlencoded", "application/octet-stream", ""}


async def json_body(request: Request) -> bytes:
    """The whole body. Raises UnsupportedMedia where the sender says that it is something else than JSON."""
    told = request.headers.get("content-type", "").partition(";")[0].strip().lower()
    if told not in TAKEN and not told.endswith("+json"):
        raise UnsupportedMedia(f"{told[:100]!r} is not taken here: send application/json")
    return await request.body()
