"""What has a number has shares by caller: pools, bounds on what goes on at a time, settings.

Each is listed with its share, or with the reason why it needs none. One that is new fails here until somebody has
thought about it: what happens to a second caller while a first one takes all of it?
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

from service.config import Config
from service.system import executors
from service.system.executors import Pool

SERVICE = Path(__file__).parents[2] / "service"
NO_SERVER = ("bench", "cli")
# Whose constants are bounds of one file or document: nobody else waits for these.
OF_FILES = ("formats", "document", "server/assets", "server/verdict")
BOUNDING = {
    "BoundedSemaphore", "Children", "ClientExecutor", "Limit", "Pool", "ProcessPoolExecutor", "Queue", "Room",
    "Semaphore", "Shares", "ThreadPoolExecutor", "FairQueue", "FairRoom", "run_in_executor", "to_thread",
}  # fmt: skip
BOUNDS = re.compile(
    r"AT_ONCE|(^|_)EACH$|^MOST$|OF_ONE|OPEN_OF|WAITS$|WAITING$|TOGETHER$|QUEUED$|REFUSALS|^ROOM$|LASTING$|FEW"
)
WORDS = re.compile(
    r"\b(" + "|".join(sorted(BOUNDING)) + r")\b|" + BOUNDS.pattern.replace("^", r"\b").replace("$", r"\b")
)

ALL_BUT_ONE = "all threads but one for one caller, in turns that go round callers"
SHARES = "shares by caller"
LIMIT = "shares by caller, of bytes of memory"
IN_TURNS = "one thread, in turns that go round callers: none waits for more than one work of another, of "
OWN = "of the service alone, at its start, its end, or for an answer that is the same for everybody"
PIECES = "milliseconds each, from asyncio's own threads, and a caller's open requests are bounded"
INSIDE = "threads within one work of a pool that has shares"
RAY = "carries all that a renderer is sent; of that turns go round clients"
CODE = {
    "server/app.py to_thread": OWN,
    "formats/sandbox/sandbox.py self.children = Children": "one for each turn",
    "formats/sandbox/sandbox.py self._cad_children = Children": "one for each turn",
    "formats/sandbox/sandbox.py self._room = FairRoom": "all but one for one caller, the one with fewest first",
    "server/callbacks/queue.py AT_ONCE": SHARES,
    "server/callbacks/queue.py shares = Shares": SHARES,
    "server/callbacks/queue.py OF_ONE_HOST": "of a host; turns go round owners",
    "server/callbacks/queue.py EACH": "of one owner",
    "server/batches/batch.py RENDERS_OF_ONE": "renders that a list shows of one batch",
    "server/batches/queue.py EACH": "of one owner",
    "server/http/connection_limits.py REFUSALS": "told why they are refused; the first one is closed",
    "server/http/connections.py Room": "an address has half of what others leave",
    "server/http/downloads.py AT_ONCE": "of a caller one at a time (`turn`)",
    "server/http/downloads.py self._room = Semaphore": "of a caller one at a time (`turn`)",
    "server/http/downloads.py LASTING": "a cache: what makes room is written again",
    "server/http/downloads.py ROOM": SHARES,
    "server/http/downloads.py self._shares = Shares": SHARES,
    "server/http/downloads.py to_thread": PIECES,
    "server/http/guard.py OPEN_OF_A_KEY": "of one key",
    "server/http/guard.py (self._of_keys, self._of_addresses) = Shares": SHARES,
    "ipc/channel.py MOST": "descriptors of one message",
    "ipc/channel.py ROOM": "bytes of one message",
    "system/executors.py self._waiting = FairQueue": ALL_BUT_ONE,
    "system/turns.py self._waiting = FairQueue": "turns go round callers, and a pool's caller has all but one",
    "system/logs.py MOST_QUEUED": "lines of the log; beyond them lines are left out, and counted",
    "system/logs.py self.records = Queue": "lines of the log; beyond them lines are left out, and counted",
    "pack/geometry/parallel.py ThreadPoolExecutor": INSIDE,
    "pack/textures/images.py AT_ONCE": INSIDE,
    "pack/textures/images.py ThreadPoolExecutor": INSIDE,
    "pack/lights/light_bounds.py LASTING": "of one scene",
    "renderers/ask.py MOST": SHARES,
    "renderers/ask.py LONG_AT_ONCE": "of a caller one at a time, which has its lock",
    "renderers/ask.py self._short = Shares": SHARES,
    "renderers/ask.py self._long = Shares": SHARES,
    "renderers/ask.py self._slots = Semaphore": "of a caller one at a time, which has its lock",
    "renderers/ray/actor.py MOST_WAITING": RAY,
    "renderers/ray/actor.py to_thread": RAY,
    "renderers/ray/carriage.py to_thread": RAY,
    "renderers/ray/gateway.py to_thread": RAY,
    "renderers/ray/lane.py MOST_TOGETHER": RAY,
    "renderers/ray/lane.py MOST_WAITING": RAY,
    "renderers/ray/lane.py to_thread": RAY,
    "renderers/replay_log.py MOST": "of one task",
    "server/renders/documents.py self._shares = Shares": SHARES,
    "server/renders/documents.py self._reserve = Shares": SHARES,
    "server/renders/slots.py AT_ONCE": "renders that are looked at in one go, of all owners in turns",
    "server/renders/slots.py FEW": "of one owner",
    "server/renders/slots.py self.waiting = FairQueue": "turns go round owners; one who has none gets the last slot",
    "server/requests/bodies.py AT_ONCE": LIMIT,
    "server/requests/bodies.py self._limit = Limit": LIMIT,
    "server/requests/parser_pool.py self._children = Children": "one for each thread of `waiting_for_parsers`",
    "server/requests/parser_pool.py self._room = FairRoom": "turns go round callers, the one with fewest bytes first",
    "server/requests/request_reader.py self.batch_memory = Limit": LIMIT,
    "server/requests/request_reader.py self.stream_memory = Limit": LIMIT,
    "server/routes/assets.py to_thread": PIECES,
    "server/routes/bsdf.py AT_ONCE": "numbers of one answer that are encoded at once",
    "server/routes/editor_files.py MOST": "files of the page, of which there are fewer",
    "server/routes/events.py AT_ONCE": "events of one stream of them",
    "server/routes/examples.py WAITING": "an example of an answer",
    "server/state.py MOST_WAITS": "of one caller",
    "server/state.py self.uploads = Shares": SHARES,
    "server/state.py self.waits = Shares": SHARES,
    "server/state.py to_thread": OWN,
    "server/streams/edit_session.py EACH": "kept states of one stream",
    "server/streams/sessions.py self._shares = Shares": "by key; without keys each stream is a client of its own",
    "server/streams/stream.py WAITING": "messages of one stream",
    "server/streams/stream.py self._executor = ClientExecutor": "a thread a stream, of which a key has its share",
    "system/executors.py parsing = Pool": ALL_BUT_ONE,
    "system/executors.py waiting_for_parsers = Pool": ALL_BUT_ONE,
    "system/executors.py packing = Pool": ALL_BUT_ONE,
    "system/executors.py storing = Pool": ALL_BUT_ONE,
    "system/executors.py storing_small = Pool": ALL_BUT_ONE,
    "system/executors.py opening = Pool": ALL_BUT_ONE,
    "system/executors.py saving = Pool": ALL_BUT_ONE,
    "system/executors.py encoding = Pool": ALL_BUT_ONE,
    "system/executors.py answering = Pool": ALL_BUT_ONE,
    "system/executors.py filming = Pool": ALL_BUT_ONE,
    "system/executors.py writing = Pool": ALL_BUT_ONE,
    "system/executors.py comparing = Pool": ALL_BUT_ONE,
    "system/executors.py resolving = Pool": ALL_BUT_ONE,
    "system/executors.py sending = Pool": ALL_BUT_ONE,
    "system/executors.py tending = Pool": ALL_BUT_ONE,
    "system/executors.py recording = Pool": IN_TURNS + "a transaction, and rows are written in order",
    "system/executors.py saving_pictures = Pool": IN_TURNS + "milliseconds",
    "system/executors.py saving_large_pictures = Pool": IN_TURNS + "one picture, and the disk writes one at a time",
    "system/executors.py reading_large_pictures = Pool": IN_TURNS + "one picture, and the disk reads one at a time",
    "system/executors.py measuring = Pool": IN_TURNS + "milliseconds",
    "system/executors.py self._threads = ThreadPoolExecutor": "the threads of a pool, or of one client",
    "system/executors.py run_in_executor": "the thread of one client",
    "system/memory.py shares = Shares": SHARES,
    "worker/division/home.py EACH": "leases of one renderer",
    "worker/helpers/compile_client.py MOST": "a record: the latest put the oldest out",
    "worker/view/frames.py MOST": "a cache: what makes room is made again",
    "worker/foreseen.py ProcessPoolExecutor": "of the command alone",
}
OF_ONE = "of one request, file or scene"
SETTINGS = {
    "max_body": OF_ONE,
    "max_bodies": SHARES,
    "max_json": "shares by caller of four times as much",
    "max_json_memory": "turns go round callers, the one with fewest bytes first",
    "max_connections": "an address has half of what others leave",
    "max_clients": SHARES,
    "max_key_clients": "of one key",
    "max_stream_memory": LIMIT,
    "max_pixels": OF_ONE,
    "max_triangles": OF_ONE,
    "max_shapes": OF_ONE,
    "max_lights": OF_ONE,
    "max_materials": OF_ONE,
    "max_textures": OF_ONE,
    "max_texels": OF_ONE,
    "max_asset": OF_ONE,
    "max_seconds": OF_ONE,
    "max_running": "turns go round owners, and the last slot is for one who has none",
    "max_queue": "a full line takes renders of owners with less than their share of it",
    "max_batch": OF_ONE,
    "max_jobs": "of one key",
    "max_key_assets": "of one key",
    "max_key_documents": "of one key, by default its share of a part of the quota",
    "keep_renders": "of one key",
    "keep_bytes": "renders of the owner that keeps most bytes make room",
    "keep_packed": "a cache: what makes room is packed again",
    "keep_seconds": OF_ONE,
    "parse_seconds": OF_ONE,
    "parse_memory": OF_ONE,
    "body_timeout": OF_ONE,
    "data_quota": "documents and waiting renders have shares; assets make room, but for fresh ones within a share",
    "data_files": "as data_quota; only bytes have a share by owner, of which a file takes a block",
    "memory": "what requests hold is a Limit; renders that wait hold nothing, and others give way",
    "gpu_memory": "pictures of tasks that rest are evicted, the longest resting first",
}


def sources() -> Iterator[tuple[str, ast.Module]]:
    for path in sorted(SERVICE.rglob("*.py")):
        name = path.relative_to(SERVICE)
        text = path.read_text() if name.parts[0] not in NO_SERVER else ""
        if WORDS.search(text):  # most files have none, and parsing all takes a second
            yield name.as_posix(), ast.parse(text)


def bounding(tree: ast.Module, of_files: bool = False) -> Iterator[str]:
    """What a module bounds: `target = Class`, or `Class` where that is part of an expression, and names of constants,
    but for those `of_files`."""
    seen = set[ast.AST]()
    for node in ast.walk(tree):
        if isinstance(node, ast.Assign | ast.AnnAssign):
            target = node.targets[0] if isinstance(node, ast.Assign) else node.target
            for call in ast.walk(node) if node.value is not None else ():
                if (name := called(call)) and name not in ("to_thread", "run_in_executor"):
                    seen.add(call)
                    yield f"{ast.unparse(target)} = {name}"
        elif (name := called(node)) and node not in seen:
            yield name
    for statement in [] if of_files else tree.body:
        if isinstance(statement, ast.Assign | ast.AnnAssign):
            targets = statement.targets if isinstance(statement, ast.Assign) else [statement.target]
            names = (each.id for target in targets for each in ast.walk(target) if isinstance(each, ast.Name))
            yield from (name for name in names if BOUNDS.search(name))


def called(node: ast.AST) -> str | None:
    """The name of a class or function that bounds something, where this calls it."""
    if not isinstance(node, ast.Call):
        return None
    function = node.func.value if isinstance(node.func, ast.Subscript) else node.func
    name = function.attr if isinstance(function, ast.Attribute) else getattr(function, "id", "")
    return name if name in BOUNDING else None


def test_everything_that_bounds_has_a_share_or_a_reason() -> None:
    found = {f"{path} {each}" for path, tree in sources() for each in bounding(tree, path.startswith(OF_FILES))}
    assert found - CODE.keys() == set(), "what happens to others while one caller takes all of it?"
    assert CODE.keys() - found == set(), "these are gone"


def test_every_setting_of_a_limit_has_a_share_or_a_reason() -> None:
    limits = set(Config(_env_file=None).limits) | {"memory", "gpu_memory"}  # type: ignore[call-arg]
    assert limits - SETTINGS.keys() == set(), "what happens to others while one caller takes all of it?"
    assert SETTINGS.keys() - limits == set(), "these are gone"


def test_no_caller_has_all_threads_of_a_pool() -> None:
    pools = {name: pool for name, pool in vars(executors).items() if isinstance(pool, Pool)}
    for name, pool in pools.items():
        says = CODE[f"system/executors.py {name} = Pool"]
        assert (pool._each < pool._most) == (says == ALL_BUT_ONE), name
        assert pool._each < pool._most or (pool._most == 1 and says.startswith(IN_TURNS)), name


def test_what_is_new_is_found() -> None:
    code = "AT_ONCE = 3\nnew = Pool('new', 2)\ndef f(self):\n  self.x = asyncio.Semaphore(2)\n  g(Shares(1, ''))\n"
    assert list(bounding(ast.parse(code))) == ["new = Pool", "self.x = Semaphore", "Shares", "AT_ONCE"]
