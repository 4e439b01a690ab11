"""The way back: what is one step to undo."""

from __future__ import annotations

from playwright.sync_api import Page


def test_each_change_is_a_step_and_those_of_one_gesture_are_one(page: Page) -> None:
    seen = page.evaluate("""async () => {
        const { Store } = await import(new URL("document/store.js", location));
        const store = new Store({ n: 0 });
        const seen = [];
        const back = (times) => {
            for (let k = 0; k < times; k++) store.undo();
            seen.push(store.state.n);
        };
        store.change({ n: 1 });
        store.change({ n: 2 });
        back(1); // of two picks the second
        back(1);
        store.change({ n: 3 }, "drag");
        store.change({ n: 4 }, "drag");
        back(1); // a drag
        store.change({ n: 5 }, "drag");
        store.seal();
        store.change({ n: 6 }, "drag");
        back(1); // of two drags the second
        store.redo();
        seen.push(store.state.n);
        return seen;
    }""")
    assert seen == [1, 0, 0, 5, 6]
