"""Nothing dies unseen: all that nobody awaits is begun in one place, and each kind of it has a test of its death."""

from __future__ import annotations

import ast
import asyncio
import sys
import threading
from pathlib import Path
from typing import cast

import pytest

from service.system import background, logs
from service.system.background import report_callbacks

SERVICE = Path(__file__).parents[2] / "service"
TESTS = Path(__file__).parent / "rendering" / "test_background.py"
# What dies in Ray's own processes, which tests of Ray start; and what works for nobody, so that a line of the log is
# all there is to tell.
OTHERS = {
    "check of the parsers' sandbox", "first frame", "watch of connections", "count of a picture's bytes",
    "deletion of renders", "end of a render", "look at the cluster's load", "large message", "end of a renderer",
    "watch for nodes that are drained", "signs of life",
}  # fmt: skip
# Tasks and threads that are begun elsewhere than in service/system/background.py: whoever begins them awaits them, or
# says here why not.
AWAITED = {
    "server/verdict/comparison.py", "server/http/downloads.py", "server/streams/stream.py", "renderers/ray/lane.py",
    "server/routes/compare.py", "server/routes/bsdf.py", "server/routes/batch_files.py", "server/storage/quota.py",
    "server/routes/stream.py", "server/routes/waiting.py",
    "server/routes/events.py",
    "renderers/ray/carriage.py",  # a future that each user of the scene awaits
    "renderers/ray/gateway.py",  # lanes, whose end `_finished` reports; a thread, whose end the hook does
    "cli/documents.py",  # a thread of a command, whose end the hook reports
}  # fmt: skip


class Bug(Exception):
    pass


def breaks() -> None:
    raise Bug


def test_all_that_nobody_awaits_is_begun_in_one_place() -> None:
    begun = set[str]()
    for path in SERVICE.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            name = getattr(node.func, "attr", getattr(node.func, "id", "")) if isinstance(node, ast.Call) else ""
            if name in ("create_task", "ensure_future", "Thread", "Timer"):
                begun.add(str(path.relative_to(SERVICE)))
    assert begun == AWAITED | {"system/background.py", "server/app.py"}, (
        "server/app.py has a timer that ends the process"
    )


def names() -> set[str]:
    """What all work in the background is called."""
    found = set[str]()
    for path in SERVICE.rglob("*.py"):
        tree = ast.parse(path.read_text())
        texts = {
            target.id: node.value.value
            for node in tree.body
            if isinstance(node, ast.Assign) and isinstance(node.value, ast.Constant)
            for target in node.targets
            if isinstance(target, ast.Name)
        }
        for node in ast.walk(tree):
            if isinstance(node, ast.Call) and node.args:
                name, first = getattr(node.func, "attr", getattr(node.func, "id", "")), node.args[0]
                if name in ("start", "do", "reported") and isinstance(first, ast.Constant | ast.Name):
                    text = first.value if isinstance(first, ast.Constant) else texts.get(first.id)
                    found |= {text} if isinstance(text, str) else set()
    return found


def test_callbacks_of_the_loop_and_threads_are_reported(
    caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = background.deaths()
    monkeypatch.setattr(threading, "excepthook", logs._thread_died)
    monkeypatch.setattr(sys, "unraisablehook", logs._finalizer_died)

    class Leaves:
        def __del__(self) -> None:
            raise Bug

    async def test() -> None:
        report_callbacks(asyncio.get_running_loop())
        asyncio.get_running_loop().call_soon(breaks)
        await asyncio.sleep(0)
        await asyncio.sleep(0)

    asyncio.run(test())
    thread = threading.Thread(target=breaks)
    thread.start()
    thread.join()
    Leaves()
    assert background.deaths() - before == {"callback": 1, "thread": 1, "finalizer": 1}
    assert sum(record.exc_info is not None for record in caplog.records) == 3


def test_each_has_a_test() -> None:
    """Those that are begun under a new name need one, too."""
    calls = [node for node in ast.walk(ast.parse(TESTS.read_text())) if isinstance(node, ast.Call)]
    asked = [call for call in calls if getattr(call.func, "id", "") == "dies"]
    keys = [key for call in asked for word in call.keywords for key in cast(ast.Dict, word.value).keys]
    tested = {cast(ast.Constant, word).value for word in [*keys, *(call.args[0] for call in asked)]}
    assert names() - OTHERS <= tested and names() >= OTHERS
