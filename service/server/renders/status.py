"""The states of a render, and its status and its errors as callers see them."""

from __future__ import annotations

import time
from dataclasses import dataclass
from datetime import UTC, datetime
from enum import Flag
from typing import Any

from service.document.quality import forecast
from service.ipc.leases import undivided
from service.ipc.messages import Failed
from service.problems import FieldError, Internal, InvalidDocument, ServiceError
from service.server.renders.store.record import End, Order, Outcome


def status(order: Order, outcome: Outcome, renderers: int, kernel: bool = False) -> dict[str, Any]:
    """As JSON; `renderers` is how many trace it. With `kernel`, what its kernel was compiled for as well: the flags'
    names are longer than all the rest."""
    progress = outcome.progress
    known: dict[str, Any] = {
        "id": order.id,
        "state": outcome.state,
        "label": order.label,
        "priority": order.priority,
        "created": iso(order.created_at),
        "started": iso(outcome.started_at),
        "ended": iso(outcome.ended_at),
        "reason": outcome.reason,
        "samples": progress.samples,
        "noise": progress.noise,
        "elapsed_s": progress.elapsed_s,
        "setup_s": outcome.setup_s,
        "eta_s": None if outcome.state in ("cancelled", "failed") else progress.eta_s,
        "forecast": forecast(progress.samples, progress.noise, progress.elapsed_s),
        "warnings": outcome.warnings,
        "renderers": renderers,
        "not_divided": undivided(order.settings.adaptive, order.settings.time_limit),
        "settings": order.settings.document(),
    }
    if kernel:
        known["kernel"] = outcome.kernel
    return known if outcome.problem is None else known | {"problem": outcome.problem}


def iso(seconds: float | None) -> str | None:
    """A time since 1970 in UTC, by RFC 3339; None where it is not known."""
    if not seconds:
        return None
    return datetime.fromtimestamp(seconds, UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")


def error_of(failed: Failed) -> ServiceError:
    return InvalidDocument([FieldError("/scene", failed.detail)]) if failed.refused else Internal(failed.detail)


@dataclass(frozen=True)
class Queued:
    """It waits for a slot, for memory, for the disk or for a renderer."""


@dataclass(frozen=True)
class Loading:
    """It has a slot; its scene is read, and sent to a renderer, which compiles its kernel."""


@dataclass(frozen=True)
class Tracing:
    """A renderer adds samples, or did and is being replaced."""


@dataclass(frozen=True)
class Ended:
    how: End


RenderState = Queued | Loading | Tracing | Ended


class PictureAt(Flag):
    """Where the newest samples of a render are."""

    NOWHERE = 0
    RENDERER = 1
    DISK = 2
    BOTH = 3


def monotonic(ended_at: float | None) -> float:
    """A time since 1970, by default now, by the monotonic clock."""
    return time.monotonic() - max(0.0, time.time() - (ended_at or time.time()))
