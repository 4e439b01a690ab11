"""Large JSON bodies are parsed beside the service, as small ones are within it, and cost no more than they may."""

from __future__ import annotations

import importlib
import json
import os
import pickle
import signal
import socket
import subprocess
import threading
import time
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from service.config import MIB, Config
from service.document import MeshShape, load_json
from service.document.text import most_bytes, weigh
from service.ipc import channel
from service.problems import InvalidDocument, MalformedJson, ServiceError, TooLarge
from service.server.requests import parser_pool
from service.server.requests.parser_pool import ParserPool
from service.server.requests.request_parser import RequestParser, unfolded
from service.system.child_processes import Child
from service.system.shares import CALLER
from service.system.turns import FairRoom
from tests.serving import SCENE, SMALL

ROWS = [[0.5 * i, i % 7, -1e-3 * i] for i in range(3000)]
MESH = {"type": "mesh", "vertices": ROWS, "faces": [[0, 1, 2], [2, 3, 4]], "material": "ball"}
REQUEST = {"scene": {**SCENE, "shapes": [*SCENE["shapes"], MESH]}, "settings": SMALL}


def config(**limits: Any) -> Config:
    return Config(_env_file=None, **limits)  # type: ignore[call-arg]


def written(document: Any) -> bytearray:
    return bytearray(json.dumps(document).encode())


@pytest.fixture(scope="module")
def pool() -> Iterator[ParserPool]:
    pool = ParserPool(config(api_key=["secret"]))
    yield pool
    pool.close()


def children() -> list[int]:
    found = []
    for task in Path("/proc/self/task").iterdir():
        found += [int(pid) for pid in (task / "children").read_text().split()]
    return [pid for pid in found if b"parser_child" in Path(f"/proc/{pid}/cmdline").read_bytes()]


def test_a_request_is_understood_as_in_the_service(pool: ParserPool) -> None:
    body = written(REQUEST)
    found, expected = pool.parse("request", body), RequestParser(config()).request(body)
    assert found.scene == expected.scene and found.settings == expected.settings
    assert found.document == expected.document and json.loads(unfolded(found.document)) == REQUEST["scene"]
    mesh = found.scene.shapes[-1]
    assert isinstance(mesh, MeshShape) and mesh.vertices is not None
    assert np.array_equal(mesh.vertices, np.array(ROWS)) and not mesh.vertices.flags.writeable


def time_of(pid: int) -> float:
    """Seconds of the processor."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def test_a_message_that_comes_during_work_ends_no_child() -> None:
    """The kernel's notice of a message may come when the message has been read. As a signal it ended the child: of
    30 files that 12 processes read at a time, one "crashed the parser"."""
    child = Child("service.server.requests.parser_child", {})
    large = {**MESH, "vertices": ROWS * 100}
    body = written({**REQUEST, "scene": {**SCENE, "shapes": [*SCENE["shapes"], large]}})
    work = parser_pool.Work("request", body, config(), 512 * MIB, 60.0)
    assert child.rights() is not None
    before = time_of(child.process.pid)
    channel.send(child.link, work)
    while time_of(child.process.pid) < before + 0.1:
        time.sleep(0.01)
    channel.send(child.link, work)
    for _ in range(2):
        assert child.answers(60) and child.process.poll() is None
        assert channel.receive(child.link, wait=True, find=parser_pool.allowed).scene.shapes
    child.kill()


@pytest.mark.parametrize(
    ("text", "kind", "said"),
    [
        (b'{"scene": {', MalformedJson, "line 1"),
        (b'{"scene": 1, "scene": 2}', MalformedJson, "twice"),
        (b"\xff", MalformedJson, "UTF-8"),
        (b"[" * 5000, MalformedJson, "deep|nested"),
        (b'{"scene": {"camera": NaN}}', InvalidDocument, "/scene/camera"),
        (b'{"scene": {"camera": 1}, "settings": {"width": 0}}', InvalidDocument, "and 2 more"),
    ],
)
def test_mistakes_are_told_as_in_the_service(
    pool: ParserPool, text: bytes, kind: type[ServiceError], said: str
) -> None:
    with pytest.raises(kind, match=said) as beside:
        pool.parse("request", bytearray(text))
    with pytest.raises(kind) as within:
        RequestParser(config()).request(bytearray(text))
    assert str(beside.value) == str(within.value)
    if isinstance(beside.value, InvalidDocument) and isinstance(within.value, InvalidDocument):
        assert beside.value.errors == within.value.errors


def test_the_process_lives_on(pool: ParserPool) -> None:
    pool.parse("request", written(REQUEST))
    before = children()
    assert len(before) == 1
    with pytest.raises(MalformedJson):
        pool.parse("request", bytearray(b"{"))
    pool.parse("request", written(REQUEST))
    assert children() == before


def test_the_process_has_no_key(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its environment is taken where it is given: from outside it cannot be read."""
    monkeypatch.setenv("SUNBOX_API_KEY", "secret")
    given: list[dict[str, str]] = []
    streams = set[Any]()
    start = subprocess.Popen

    def started(*arguments: Any, env: dict[str, str], **more: Any) -> Any:
        given.append(env)
        streams.update(more[name] for name in ("stdin", "stdout", "stderr"))
        return start(*arguments, env=env, **more)

    monkeypatch.setattr(subprocess, "Popen", started)
    pool = ParserPool(config(api_key=["secret"]))
    pool.parse("request", written(REQUEST))
    pool.close()
    assert given and "PATH" in given[0]
    assert streams == {subprocess.DEVNULL}, "one that was taken over could write lines of the server's log"
    assert not any(name.startswith("SUNBOX_") or "secret" in value for name, value in given[0].items())


def test_what_would_take_too_much_memory_is_not_begun() -> None:
    """The same text as one long list of numbers is fine: what counts is what the values take."""
    with pytest.raises(TooLarge, match="SUNBOX_MAX_JSON_MEMORY"):
        ParserPool(config(max_json_memory=8 * MIB)).parse("request", bytearray(b"[" + b"[]," * 300_000 + b"[]]"))


def test_what_takes_too_long_is_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    pool = ParserPool(config(parse_seconds=0.01, max_json_memory=1 << 40))
    monkeypatch.setattr(parser_pool, "SECONDS_PER_BYTE", 1e-3)
    pool.parse("request", written(REQUEST))
    monkeypatch.setattr(parser_pool, "SECONDS_PER_BYTE", 0)
    with pytest.raises(TooLarge, match=r"longer|processor time"):
        pool.parse("request", bytearray(b"[" + b'{"a":1},' * 800_000 + b"1]"))
    assert pool._children.idle == []
    pool.close()


def test_a_process_that_dies_is_replaced(pool: ParserPool) -> None:
    pool.parse("request", written(REQUEST))
    (pid,) = children()
    big = bytearray(b"[" + b'{"a":1},' * 1_000_000 + b"1]")
    killer = threading.Timer(0.2, os.kill, [pid, signal.SIGKILL])
    killer.start()
    with pytest.raises(TooLarge, match="memory"):
        pool.parse("request", big)
    killer.join()
    assert pool.parse("request", written(REQUEST)).scene.shapes
    assert children() != [pid]


@pytest.mark.parametrize(
    "text",
    ["[" + "[]," * 1000 + "[]]", "[" + "{}," * 1000 + "{}]", "[" + "0.25," * 1000 + "1]", json.dumps(REQUEST),
     '{"a":' * 40 + "1" + "}" * 40, json.dumps({str(i): [i] for i in range(1000)})],
)  # fmt: skip
def test_memory_is_never_taken_for_less_than_it_is(text: str) -> None:
    import tracemalloc

    tracemalloc.start()
    try:
        value = load_json(text)
        taken = tracemalloc.get_traced_memory()[0]
    finally:
        tracemalloc.stop()
    assert taken < most_bytes(text) == most_bytes(text.encode())
    assert taken < weigh(value) + 20_000 < 8 * taken + 40_000


def test_nobody_overtakes_a_body_that_waits_for_memory() -> None:
    """Small ones that always find room would keep a large one waiting for ever."""
    room, order = FairRoom(10, each=10), list[str]()
    large_waits = threading.Event()

    def take(name: str, size: int) -> None:
        with room.taken(size):
            order.append(name)

    with room.taken(5):
        threads = [threading.Thread(target=take, args=("large", 10))]
        threads[0].start()
        while not len(room._waiting):
            large_waits.wait(0.001)
        threads.append(threading.Thread(target=take, args=("small", 1)))
        threads[1].start()
        while len(room._waiting) < 2 and not order:
            large_waits.wait(0.001)
        assert order == []
    for thread in threads:
        thread.join(30)
    assert order == ["large", "small"]


def test_room_goes_round_callers() -> None:
    """A second large body of one caller waits for the first one; another caller's does not wait for the second."""
    room, order = FairRoom(10, each=10), list[str]()
    pause = threading.Event()

    def take(name: str) -> None:
        CALLER.set(name[0])
        with room.taken(10):
            order.append(name)

    CALLER.set("a")
    with room.taken(10):
        threads = [threading.Thread(target=take, args=(name,)) for name in ("a2", "a3", "b1")]
        for number, thread in enumerate(threads):
            thread.start()
            while len(room._waiting) <= number:
                pause.wait(0.001)
    CALLER.set("")
    for thread in threads:
        thread.join(30)
    assert order == ["b1", "a2", "a3"]


class Taken:
    """What somebody sends who has taken over the parser: to be unpickled, it calls a function."""

    def __reduce__(self) -> Any:
        return os.mkdir, ("/tmp/never-made",)


def test_an_answer_names_no_function() -> None:
    ours, theirs = channel.pair()
    with ours, theirs:
        for answer in (Taken(), json.dumps, os.system, importlib.import_module, RequestParser.request):
            channel.send(theirs, answer)
            with pytest.raises(pickle.UnpicklingError):
                channel.receive(ours, wait=True, find=parser_pool.allowed)
        theirs.send(pickle.dumps(Taken()))  # in the place of the envelope
        with pytest.raises(pickle.UnpicklingError):
            channel.receive(ours, wait=True, find=parser_pool.allowed)
        channel.send(theirs, RequestParser(config()).request(written(REQUEST)), sealed=True)
        assert channel.receive(ours, wait=True, find=parser_pool.allowed).settings.width == SMALL["width"]
    assert not Path("/tmp/never-made").exists()


def test_the_memory_of_an_answer_does_not_change_any_more() -> None:
    """A sender that cut it off would end the server, and one that changed it would undo what was looked at."""
    answer = RequestParser(config()).request(written(REQUEST))
    ours, theirs = channel.pair()
    with ours, theirs:
        channel.send(theirs, answer)
        with pytest.raises(pickle.UnpicklingError, match="could still change"):
            channel.receive(ours, wait=True, find=parser_pool.allowed)
        datagram, (memory,) = channel.encode(answer, sealed=True)
        for change in (partial(os.ftruncate, memory, 0), partial(os.pwrite, memory, b"other", 0)):
            with pytest.raises(PermissionError):
                change()
        found = channel.decode(datagram, (memory,), parser_pool.allowed)
        assert np.array_equal(found.scene.shapes[-1].vertices, np.array(ROWS))
        with Path("/dev/zero").open("rb") as other:
            socket.send_fds(theirs, [datagram], [other.fileno()])
            with pytest.raises(pickle.UnpicklingError, match="could still change"):
                channel.receive(ours, wait=True, find=parser_pool.allowed)


def test_a_mesh_of_an_answer_is_looked_at_again() -> None:
    parsed = RequestParser(config()).request(written(REQUEST))
    assert parser_pool._believed(parsed) is parsed
    mesh = parsed.scene.shapes[-1]
    assert isinstance(mesh, MeshShape)
    object.__setattr__(mesh, "faces", np.array([[0, 1, len(ROWS)]], np.int32))
    with pytest.raises(parser_pool.ParserFailed):
        parser_pool._believed(parsed)
