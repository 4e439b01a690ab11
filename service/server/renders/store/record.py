"""The stored record of one render, but for its document and its pictures."""

from __future__ import annotations

import time
from collections.abc import Iterable
from dataclasses import asdict, dataclass, field, replace
from typing import Any, Literal, get_args

from service.document.quality import ResolvedSettings, resolve
from service.document.settings import Settings
from service.ipc.messages import Loaded, Progress, Reason
from service.problems import ANSWERS, FieldError, Internal, InvalidDocument, ServiceError, problem
from service.server.renders.store.fitting import Unfit, fit, read, stored, unknown

End = Literal["done", "cancelled", "failed"]
State = Literal["queued", "running", End]
ENDED: tuple[End, ...] = get_args(End)


@dataclass(frozen=True)
class Order:
    """A render as it was asked for."""

    id: str
    owner: str  # of the key; others do not learn of the render
    settings: ResolvedSettings
    label: str | None = None
    priority: int = 0  # among the owner's renders, higher ones start first
    created_at: float = 0.0  # s since 1970
    bytes: int = 0  # that it adds to the store: its document, or its patch where another render brings the document
    callback: str | None = None  # URL that is told of its end; not there where the order comes from the store


@dataclass(frozen=True)
class IdempotencyKey:
    """The caller's name for one request: within 24 h it gives the same render."""

    key: str
    digest: str  # of the request's body as parsed JSON


@dataclass(frozen=True)
class Outcome:
    """The outcome of a render so far. `problem` is the body of an RFC 9457 answer."""

    state: State = "queued"
    reason: Reason | None = None
    progress: Progress = field(default_factory=Progress)
    setup_s: float = 0.0
    warnings: list[str] = field(default_factory=list)
    kernel: dict[str, Any] | None = None
    problem: dict[str, Any] | None = None
    started_at: float | None = None  # s since 1970, when it first left the line
    ended_at: float | None = None  # s since 1970
    starts: int = 0  # how many servers began to render it

    def failed(self, error: ServiceError, ended_at: float) -> Outcome:
        return replace(self, state="failed", problem=problem(error), ended_at=ended_at)

    def warned(self, warnings: Iterable[str]) -> Outcome:
        """With these warnings too, each once."""
        return replace(self, warnings=list(dict.fromkeys([*self.warnings, *warnings])))

    def loaded(self, message: Loaded) -> Outcome:
        state: State = "running" if self.state == "queued" else self.state
        setup_s = self.setup_s + message.setup_s
        return replace(self, state=state, setup_s=setup_s, kernel=message.kernel).warned(message.warnings)

    @property
    def error(self) -> ServiceError | None:
        """The error that `problem` is the body of."""
        if self.problem is None:
            return None
        detail, type = str(self.problem["detail"]), str(self.problem["type"])
        if "errors" in self.problem:
            return InvalidDocument(FieldError(each["pointer"], each["detail"]) for each in self.problem["errors"])
        kinds = (kind for kind, row in ANSWERS.items() if type.endswith(":" + row.type))
        return next(kinds, Internal)(detail)

    def json(self) -> str:
        """Everything but the state and the time of its end, which have columns of their own."""
        values = asdict(self)
        del values["state"], values["ended_at"]
        return stored(values)


@dataclass(frozen=True)
class StoredRender:
    """A render as the store has it. `number` rises in the order of arrival."""

    number: int
    order: Order
    outcome: Outcome
    gone: bool = False  # all but its id and its state was deleted
    unfit: str | None = None  # why it is failed, though its row says otherwise: this version cannot read that
    unknown: frozenset[str] = frozenset()  # fields of its row that this version leaves out


def settings_json(settings: ResolvedSettings) -> str:
    return stored(asdict(settings))


def stored_render(
    number: int,
    id: str,
    owner: str,
    label: str | None,
    priority: int,
    created_at: float,
    settings: str,
    size: int,
    state: str,
    ended_at: float | None,
    outcome: str,
    gone: int,
) -> StoredRender:
    """A render from its row. What cannot be read makes it a failed one, whose row stays as it is.

    Of one that is gone only the state is known: its settings are the default ones.
    """
    left_out, faults = set[str](), list[str]()
    knobs, become = resolve(Settings()), Outcome()
    try:
        if not gone:
            values = read(settings)
            left_out |= unknown(ResolvedSettings, values)
            knobs = fit(ResolvedSettings, values)
    except Unfit as error:
        faults.append(f"settings: {error}")
    try:
        values = read(outcome)
        left_out |= unknown(Outcome, values)
        become = fit(Outcome, values | {"state": state, "ended_at": ended_at})
        become.error  # noqa: B018 (it reads `problem`)
    except (Unfit, KeyError, TypeError) as error:
        faults.append(f"outcome: {error}")
    unfit = "; ".join(faults) or None
    if unfit is not None:
        detail = f"What the server stored of this render cannot be read, so it cannot go on: {unfit}. Send it again."
        become = become.failed(Internal(detail), ended_at if isinstance(ended_at, float) else time.time())
    order = Order(id, owner, knobs, label, priority, created_at, size)
    return StoredRender(number, order, become, bool(gone), unfit, frozenset(left_out))
