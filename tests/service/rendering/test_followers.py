"""Who follows renders hears of each change once, of each end once, and of other owners' renders nothing."""

from __future__ import annotations

import asyncio
from dataclasses import dataclass, field

from service.server.renders.followers import Changes, Followers


@dataclass
class Render:
    id: str
    owner: str = "anna"
    finished: asyncio.Event = field(default_factory=asyncio.Event)


def test_changes_meanwhile_are_one_and_keep_their_order() -> None:
    async def scenario() -> None:
        followers = Followers[Render]()
        first, second, strange = Render("a"), Render("b"), Render("c", "bert")
        with followers.follower("anna") as follower:
            for render in (first, second, strange, first, second, first):
                followers.tell(render)
            assert await follower.next(1, 1.0) == [first]
            followers.tell(first)  # behind what waits
            assert await follower.next(9, 1.0) == [second, first]
            assert await follower.next(9, 0.01) == []
        followers.tell(first)
        with followers.follower("anna") as later:
            assert await later.next(9, 0.01) == [], "it hears of nothing that was before"

    asyncio.run(scenario())


def test_the_end_is_heard_once_and_is_the_last() -> None:
    async def scenario() -> None:
        followers, changes, render = Followers[Render](), Changes[Render](), Render("a")
        changes.followers = followers
        with followers.follower("anna") as follower:
            render.finished.set()
            changes.tell(render)
            assert await follower.next(9, 1.0) == [render]
            changes.tell(render)  # a last message of the renderer
            assert await follower.next(9, 0.01) == []

    asyncio.run(scenario())


def test_closing_ends_the_waiting() -> None:
    async def scenario() -> None:
        followers = Followers[Render]()
        with followers.follower("anna") as follower:
            waiting = asyncio.create_task(follower.next(9, 60.0))
            await asyncio.sleep(0)
            followers.close()
            assert await waiting == [] and follower.closed

    asyncio.run(scenario())
