"""Keys: which one a request carries, and a name for its owner that reveals nothing of the key."""

from __future__ import annotations

import hmac
from collections.abc import Iterable, Sequence
from hashlib import sha256

from service.problems import Unauthorized

PROTOCOL = "sunbox.key."  # a WebSocket subprotocol: browsers let a page send no header there


class Keys:
    def __init__(self, keys: Iterable[str]) -> None:
        self._keys = [key.encode() for key in keys]

    @property
    def asked_for(self) -> bool:
        return bool(self._keys)

    def owner(self, authorization: str | None, protocols: Sequence[str] = ()) -> str:
        """The owner of the key in the `Authorization` header or among the subprotocols. Raises Unauthorized."""
        scheme, _, bearer = (authorization or "").partition(" ")
        shown = [bearer.strip()] if scheme.lower() == "bearer" else []
        shown += [protocol.removeprefix(PROTOCOL) for protocol in protocols if protocol.startswith(PROTOCOL)]
        for key in shown:
            # Every comparison takes the same time, wherever the keys differ.
            matches = [hmac.compare_digest(key.encode(), known) for known in self._keys]
            if any(matches):
                return sha256(self._keys[matches.index(True)]).hexdigest()[:16]
        raise Unauthorized(
            "A key is needed: Authorization: Bearer KEY, or the WebSocket subprotocol sunbox.key.KEY."
            if not shown
            else "This key is not known here."
        )
