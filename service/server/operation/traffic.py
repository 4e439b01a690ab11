"""Counts requests and their duration since the server began."""

from __future__ import annotations

from collections import Counter

from service.renderers.statistics import Distribution

METHODS = ("GET", "HEAD", "POST", "PUT", "DELETE", "OPTIONS", "WEBSOCKET")


class Traffic:
    """Requests since the server began."""

    def __init__(self) -> None:
        self.count: Counter[tuple[str, str, str]] = Counter()
        self.seconds = Distribution()

    def heard(self, method: str, route: str, status: int, seconds: float) -> None:
        """Count a request. `route` is the address's pattern, "" for none: the number of addresses is unbounded."""
        known = method if method in METHODS else "OTHER"
        self.count[known, route or "other", str(status)] += 1
        if known != "WEBSOCKET":
            self.seconds.add(seconds)
