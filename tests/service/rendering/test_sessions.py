"""Connections that drop, come back, are taken up elsewhere or refused, against a real server."""

from __future__ import annotations

import asyncio
import time
from typing import Any, cast

import pytest
from websockets.exceptions import ConnectionClosed

from service.config import Config
from service.formats import Assets
from service.problems import NotFound, TooManyRequests, Unavailable
from service.renderers.local.supervisor import Supervisor
from service.server.requests.request_reader import RequestReader
from service.server.streams import sessions
from service.server.streams.sessions import Sessions
from tests.calls import metrics
from tests.serving import ENDLESS, KEYS, Client, Picture, Server, wait_until

READER = RequestReader(Config(_env_file=None), cast(Assets, None))  # type: ignore[call-arg]


def entered(server: Server, session: str | None = None) -> tuple[Client, str]:
    """A stream that has said hello, and its session."""
    client = Client(server.url, session=session)
    hello, _ = client.until("hello")
    return client, hello["session"]


def closed_with(client: Client) -> int:
    with client, pytest.raises(ConnectionClosed) as closed:
        client.until("never")
    assert closed.value.rcvd is not None
    return closed.value.rcvd.code


def pictures(heard: list[Any]) -> list[Picture]:
    return [message for message in heard if isinstance(message, Picture)]


def test_a_dropped_connection_is_taken_up_with_its_samples(server: Server) -> None:
    first, session = entered(server)
    first.acknowledges = False
    waiting, traced = 'sunbox_streams{state="waiting"}', 'sunbox_samples_total{renderer="0"}'
    first.start(settings={**ENDLESS, "width": 64, "height": 64})
    frames = [first.frame(), first.frame()]
    before = metrics(server)[waiting]
    first.socket.socket.close()  # no farewell
    wait_until(lambda: metrics(server)[waiting] > before)

    def stands_still() -> bool:
        samples = metrics(server)[traced]
        time.sleep(0.3)  # the renderer reports every 0.25 s while it traces
        return metrics(server)[traced] == samples

    wait_until(stands_still)  # it is paused meanwhile
    second, again = entered(server, session)
    with second:
        assert again == session
        taken = second.frame()
        assert taken.generation == 1 and taken.seq == frames[-1].seq + 1 and taken.samples >= frames[-1].samples
        more = [second.frame() for _ in range(4)]  # the old frames' credits are free
        assert more[-1].samples > taken.samples and more[-1].seq == taken.seq + 4
        second.say("update", generation=2, settings={"seed": 1})
        assert second.frame(generation=2)


def test_a_picture_that_rests_rests_on(server: Server) -> None:
    """Done is said again, and what the client has paused stays so."""
    first, session = entered(server)
    with first:
        first.start()
        done, _ = first.finished()
    second, _ = entered(server, session)
    with second:
        assert second.finished()[0] == done
        second.say("update", generation=2, settings=ENDLESS)
        second.frame(generation=2)
        second.say("pause")
        second.say("ping")
        second.until("pong")
    third, _ = entered(server, session)
    with third:
        samples = third.frame().samples
        assert not third.silence(0.3)
        third.say("resume")
        assert third.frame().samples > samples


def test_taken_up_elsewhere(server: Server) -> None:
    first, session = entered(server)
    first.start(settings=ENDLESS)
    first.frame()
    second, _ = entered(server, session)
    with second:
        assert closed_with(first) == 4409
        assert second.frame().generation == 1
        second.say("update", generation=2, settings={"seed": 1})
        assert second.frame(generation=2)


@pytest.mark.parametrize("session", ["", "x" * 43])
def test_a_session_that_is_gone(server: Server, session: str) -> None:
    assert closed_with(Client(server.url, session=session)) == 4404


def test_how_many_and_how_long(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without a renderer: who is let in, and what is forgotten when."""
    monkeypatch.setattr(sessions, "RETURN_S", 0.05)

    async def test() -> None:
        supervisor: Any = Supervisor()
        supervisor.open = lambda listener, client="": 1
        kept = Sessions(supervisor, READER, most=2)
        one, two = kept.enter(None), kept.enter(None)
        assert one.id != two.id and kept.attended == 2
        with pytest.raises(TooManyRequests):
            kept.enter(None)
        assert kept.enter(one.id) is one  # takes a place that is its own
        kept.leave(one)
        kept.leave(one)
        assert (kept.attended, kept.waiting) == (1, 1)
        others = [kept.enter(None)]
        with pytest.raises(TooManyRequests):
            kept.enter(one.id)
        for session in others:
            kept.leave(session)
        for _ in range(5):  # coming and going leaves no more sessions than clients
            kept.leave(kept.enter(None))
        assert (kept.attended, kept.waiting) == (1, 2)
        await asyncio.sleep(0.2)
        assert (kept.attended, kept.waiting) == (1, 0)
        with pytest.raises(NotFound):
            kept.enter(one.id)
        assert one.running.cancelled()
        kept.close("Good night.")
        assert two.stream.ended is not None and two.stream.ended.code == 1001
        kept.leave(two)
        assert kept.attended == kept.waiting == 0
        await asyncio.sleep(0)

    asyncio.run(test())


def test_all_streams_of_a_key_share_its_part() -> None:
    """Without keys each has its own; `renderers.open` gives one to a task without a client."""

    async def test() -> None:
        clients: list[str] = []
        supervisor: Any = Supervisor()
        supervisor.open = lambda listener, client="": clients.append(client) or len(clients)
        kept = Sessions(supervisor, READER, most=4)
        for owner in ("anna", "anna", "bert", ""):
            kept.enter(None, owner=owner)
        assert clients == ["anna", "anna", "bert", ""]
        kept.close("the end")

    asyncio.run(test())


def test_a_session_belongs_to_its_key(strict: Server) -> None:
    """Whoever has read its id somewhere else does not take it up."""
    anna, bert = KEYS
    first = Client(strict.url, key=anna)
    session = first.until("hello")[0]["session"]
    assert closed_with(Client(strict.url, session=session, key=bert)) == 4404
    assert closed_with(Client(strict.url, key=anna)) == 4429, "one of three is her share"
    with Client(strict.url, key=bert) as other:
        other.until("hello")
    again = Client(strict.url, session=session, key=anna)  # its own place
    with again:
        assert again.until("hello")[0]["session"] == session
    assert closed_with(first) == 4409
    log = strict.log.read_text()
    assert session not in log and not any(key in log for key in KEYS)


def test_one_key_does_not_take_all_places() -> None:
    """Neither those of clients that are connected, nor those of clients that may come back."""

    async def test() -> None:
        supervisor: Any = Supervisor()
        supervisor.open = lambda listener, client="": 1
        kept = Sessions(supervisor, READER, most=4)
        annas = [kept.enter(None, owner="anna") for _ in range(2)]
        with pytest.raises(TooManyRequests, match="Your own streams"):
            kept.enter(None, owner="anna")
        bert, carl = (
            kept.enter(None, owner="bert"),
            kept.enter(None, owner="carl"),
        )  # the last one is for who has none
        with pytest.raises(TooManyRequests, match="SUNBOX_MAX_CLIENTS"):
            kept.enter(None, owner="doris")
        for session in (bert, carl, *annas):
            kept.leave(session)
        assert kept.attended == 0
        for _ in range(5):  # Anna comes and goes
            kept.leave(kept.enter(None, owner="anna"))
        assert kept.enter(bert.id, owner="bert") is bert
        bounded = Sessions(supervisor, READER, most=8, each=1)
        bounded.enter(None, owner="anna")
        with pytest.raises(TooManyRequests, match="SUNBOX_MAX_KEY_CLIENTS"):
            bounded.enter(None, owner="anna")
        others = Sessions(supervisor, READER, most=3, each=1)
        assert len({others.enter(None).id for _ in range(3)}) == 3  # without keys each is its own client

    asyncio.run(test())


def test_a_stream_that_cannot_begin_takes_no_place() -> None:
    async def test() -> None:
        supervisor: Any = Supervisor()

        def refuse(listener: Any, client: str = "") -> int:
            raise Unavailable("nothing renders")

        supervisor.open = refuse
        kept = Sessions(supervisor, READER, most=2)
        for _ in range(3):
            with pytest.raises(Unavailable):
                kept.enter(None, owner="anna")
        assert kept.attended == 0

    asyncio.run(test())
