"""What the processes take beside what the server says that it holds, while requests of each kind wait or are done."""

from __future__ import annotations

import io
import json
import re
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from tests.serving import ENDLESS, SCENE, Client, Server, families, served, wait_until

MIB = 1 << 20
LOOKS = 4  # of about a tenth of a second
SPHERES = 18_000  # a document of 1.5 MB
TINY = {"width": 16, "height": 16, "max_samples": 1}
RESIDENT = re.compile(r"^Pss: +(\d+) kB", re.MULTILINE)

pytestmark = pytest.mark.slow  # minutes, and the bounds of each kind are tested one by one elsewhere


def resident(server: Server) -> int:
    """The bytes of memory of all processes, what they share counted once."""
    total = 0
    for pid in families(server.process.pid):
        try:
            total += int(RESIDENT.findall(Path(f"/proc/{pid}/smaps_rollup").read_text())[0]) << 10
        except (OSError, IndexError):
            continue  # it has ended
    return total


def counted(server: Server) -> int:
    return sum(server.http.get("/v1/info").json()["memory"]["used"].values())


class Watch:
    """The largest excess of what is resident over what is counted, both since its start, that lasts for some looks:
    what one process releases, another one frees a moment later."""

    def __init__(self, server: Server) -> None:
        self._server = server
        self._before = resident(server), counted(server)
        self._last = deque[int](maxlen=LOOKS)
        self.worst, self.most_resident, self.most_counted = -(1 << 62), 0, 0

    def look(self) -> None:
        known = counted(self._server)
        grown = resident(self._server) - self._before[0]
        held = max(known, counted(self._server)) - self._before[1]  # both change while the processes are read
        self.most_resident, self.most_counted = max(self.most_resident, grown), max(self.most_counted, held)
        self._last.append(int(grown - 1.25 * held))
        if len(self._last) == LOOKS:
            self.worst = max(self.worst, min(self._last))


@contextmanager
def watched(server: Server) -> Iterator[Watch]:
    watch, ended = Watch(server), threading.Event()

    def look() -> None:
        while not ended.wait(0.05):
            watch.look()

    looking = threading.Thread(target=look)
    looking.start()
    try:
        yield watch
    finally:
        ended.set()
        looking.join()


def large(tag: int, count: int = SPHERES) -> dict[str, Any]:
    """A scene of its own for each tag."""
    places = np.random.default_rng(tag).uniform(-4, 4, (count, 3)).round(4).tolist()
    spheres = [{"type": "sphere", "center": place, "radius": 0.02, "material": "ball"} for place in places]
    return SCENE | {"shapes": SCENE["shapes"] + spheres}


@pytest.fixture
def busy(tmp_path: Path) -> Iterator[Server]:
    """A server whose places for renders are taken by small ones without end, so that others wait."""
    with served(tmp_path, SUNBOX_MAX_RUNNING="1", SUNBOX_MAX_JOBS="64") as server:
        for body in (SCENE, large(0)):  # its kernels, parsers and caches are there
            assert server.http.post("/v1/render", json={"scene": body, "settings": TINY}).status_code == 200
        first = server.http.post("/v1/renders", json={"scene": SCENE, "settings": ENDLESS}).json()["id"]
        wait_until(lambda: server.http.get(f"/v1/renders/{first}").json()["samples"] > 0)
        yield server


def renders(server: Server, leave: ExitStack) -> None:
    for tag in range(1, 9):
        assert server.http.post("/v1/renders", json={"scene": large(tag), "settings": TINY}).status_code == 202


def batches(server: Server, leave: ExitStack) -> None:
    for tag in range(1, 9):
        body = {"scene": large(tag), "settings": TINY, "over": [{"turntable": 50}]}
        assert server.http.post("/v1/batches", json=body).status_code == 202


def streams(server: Server, leave: ExitStack) -> None:
    for tag in range(1, 5):
        client = leave.enter_context(Client(server.url))
        client.start(scene=large(tag, 10_000), settings=TINY)  # a message has at most a MiB
        client.frame()


def answers(server: Server, leave: ExitStack) -> None:
    """Pictures that somebody waits for, one after the other."""
    for tag in range(1, 5):
        body = {"scene": large(tag), "settings": {"width": 512, "height": 512, "max_samples": 1}}
        assert server.http.post("/v1/render", json=body).status_code == 200


def comparisons(server: Server, leave: ExitStack) -> None:
    sides = [{"scene": large(tag), "settings": {"width": 256, "height": 256, "max_samples": 1}} for tag in (1, 2)]
    assert server.http.post("/v1/compare", json=dict(zip("ab", sides, strict=True))).status_code == 200


def conversions(server: Server, leave: ExitStack) -> None:
    for tag in range(1, 4):
        body = {"scene": large(tag), "format": "glb"}
        answer = server.http.post("/v1/export", json=body)
        assert answer.status_code == 200, answer.text


def animations(server: Server, leave: ExitStack) -> None:
    size = {"width": 400, "height": 400, "max_samples": 1}
    body = {"scene": SCENE, "settings": size, "priority": 5, "over": [{"turntable": 12}]}
    for id in [each["id"] for each in server.http.get("/v1/renders").json()]:
        server.http.delete(f"/v1/renders/{id}")  # the one without end
    batch = server.http.post("/v1/batches", json=body).json()["id"]
    assert server.http.get(f"/v1/batches/{batch}?wait=120").json()["state"] == "done"
    for name in ("sheet", "animation?format=gif", "images.zip?format=npy"):
        assert server.http.get(f"/v1/batches/{batch}/{name}").status_code == 200, name


def grid(count: int, tag: int) -> bytes:
    """An OBJ file of a square of count x count vertices, with texture coordinates."""
    step = 1 / (count - 1)
    places = [(x * step, y * step) for y in range(count) for x in range(count)]
    lines = [f"v {4 * x - 2:.4f} {0.001 * tag:.4f} {2 - 4 * y:.4f}" for x, y in places]
    lines += [f"vt {x:.4f} {y:.4f}" for x, y in places]
    for y in range(count - 1):
        for x in range(count - 1):
            corners = [y * count + x + 1, y * count + x + 2, (y + 1) * count + x + 2, (y + 1) * count + x + 1]
            lines.append("f " + " ".join(f"{each}/{each}" for each in corners))
    return "\n".join(lines).encode()


def relief(size: int) -> bytes:
    """A PNG of random heights."""
    file = io.BytesIO()
    Image.fromarray(np.random.default_rng(size).integers(0, 255, (size, size), np.uint8)).save(file, "PNG")
    return file.getvalue()


def uploaded(server: Server, data: bytes) -> str:
    return str(server.http.post("/v1/assets", content=data).raise_for_status().json()["id"])


def meshes(server: Server, leave: ExitStack) -> None:
    for tag in range(2):
        mesh = {"type": "mesh", "asset": uploaded(server, grid(700, tag)), "material": "ball"}
        scene = SCENE | {"shapes": [*SCENE["shapes"], mesh]}
        answer = server.http.post("/v1/render", json={"scene": scene, "settings": TINY})
        assert answer.status_code == 200, answer.text


def images(server: Server, leave: ExitStack) -> None:
    for size in (4096, 4100):
        textures = {"t": {"asset": uploaded(server, relief(size))}}
        materials = SCENE["materials"] | {"ball": {"type": "diffuse", "albedo": {"texture": "t"}}}
        scene = SCENE | {"textures": textures, "materials": materials}
        answer = server.http.post("/v1/render", json={"scene": scene, "settings": TINY})
        assert answer.status_code == 200, answer.text


def reliefs(server: Server, leave: ExitStack) -> None:
    """Meshes that are cut until their triangles follow an image of heights."""
    mesh = {"type": "mesh", "asset": uploaded(server, grid(40, 0)), "material": "relief", "displacement": True}
    materials = {"relief": {"type": "diffuse", "albedo": 0.5, "height": {"texture": "t", "scale": 0.1}}}
    scene = SCENE | {
        "textures": {"t": {"asset": uploaded(server, relief(512))}},
        "materials": SCENE["materials"] | materials,
        "shapes": [*SCENE["shapes"], mesh | {"max_edge": 0.008}],  # 1.5 million triangles
    }
    answer = server.http.post("/v1/render", json={"scene": scene, "settings": TINY})
    assert answer.status_code == 200, answer.text


KINDS: list[Callable[[Server, ExitStack], None]] = [
    renders,
    batches,
    streams,
    answers,
    comparisons,
    conversions,
    animations,
    meshes,
    images,
    reliefs,
]


@pytest.mark.parametrize("kind", KINDS, ids=lambda each: each.__name__)
def test_what_is_held_is_counted(busy: Server, kind: Callable[[Server, ExitStack], None]) -> None:
    """Within a quarter and 64 MB."""
    with ExitStack() as leave, watched(busy) as watch:
        kind(busy, leave)
        time.sleep(1)
    said = json.dumps({name: value // MIB for name, value in vars(watch).items() if isinstance(value, int)})
    print(kind.__name__, said)
    assert watch.worst <= 64e6, said
