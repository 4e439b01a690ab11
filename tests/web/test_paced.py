"""Work at a pace, in the browser that runs it."""

from __future__ import annotations

from itertools import pairwise

import pytest
from playwright.sync_api import Page


@pytest.mark.parametrize("takes_ms", [0, 30])
def test_paced_work_misses_nothing_that_was_asked_for(page: Page, takes_ms: int) -> None:
    done, asked, hurried_ms = page.evaluate(
        """async (takes_ms) => {
        const { Paced } = await import(new URL("lib/paced.js", location));
        const sleep = (ms) => new Promise((resolve) => setTimeout(resolve, ms));
        const done = [];
        let asked = 0, ended = 0;
        const paced = new Paced(100, async () => {
            done.push({ seen: asked, at: performance.now() });
            if (takes_ms) await sleep(takes_ms);
            ended += 1;
        });
        for (let i = 0; i < 30; i++) {
            asked += 1;
            paced.ask();
            await sleep(5);
        }
        await sleep(300);
        const rested = done.length;
        const next = async () => {
            const count = ended;
            paced.ask();
            while (ended === count) await sleep(1);
        };
        await next();
        paced.hurry();
        await next();
        return [done.slice(0, rested), asked, done.at(-1).at - done.at(-2).at];
    }""",
        takes_ms,
    )
    assert done[0]["seen"] == 1 and done[-1]["seen"] == asked, "the first at once, and the last as well"
    assert all(after["at"] - before["at"] > 98 + takes_ms for before, after in pairwise(done))
    assert hurried_ms < 98 + takes_ms, "without a rest"
