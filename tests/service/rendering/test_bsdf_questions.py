"""Questions about a material's BSDF among pictures: nobody stands still for them, and none is left behind."""

from __future__ import annotations

import asyncio
import subprocess
import sys
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gpu import Renderer
from gpu.precompile import kernel_keys
from service.document import DiffuseMaterial, parse_scene
from service.document.material.openpbr import OpenpbrMaterial
from service.ipc.messages import EvaluateBsdf, Image, Loaded, Read, StopRule, Update
from service.pack import pack, pack_material
from service.problems import TooManyRequests
from service.renderers.ask import LONG_AT_ONCE, MOST, BsdfQuestions
from service.renderers.local.supervisor import Supervisor
from tests.documents import Shelf
from tests.serving import SCENE
from tests.supervisors import LINEAR, SIZE, Ears, Rendering, compile_helpers, with_supervisor

GREY = pack_material(DiffuseMaterial(type="diffuse", albedo=0.5))
UP = np.array([[0.0, 0.0, 1.0]])
SHORT = EvaluateBsdf(0, "values", GREY, UP, UP)
# Its kernel takes LLVM longest, so that pictures are seen meanwhile whatever else the machine does.
DEAR = EvaluateBsdf(0, "values", pack_material(OpenpbrMaterial(type="openpbr")), UP, UP)
LONG = EvaluateBsdf(
    0, "albedo", GREY, np.repeat(UP, 4096, axis=0), UP[:0], samples=1 << 20
)  # 20 s of two quick cores

# The kernels of `openpbr` take as long as all others together; a record of `measured` that is all zeros, as that of a
# bare material, cannot be sampled.
LEFT_OUT = ("HAS_OPENPBR", "HAS_MEASURED")
AHEAD = f"""
from gpu.precompile.kernel_keys import bsdf_keys
from gpu.precompile.precompiler import Precompiler
precompiler = Precompiler()
print(all([precompiler.compile(key)[1] for key in bsdf_keys() if not any(dict(key.defines)[f] for f in {LEFT_OUT})]))
"""
EVALUATOR = f"""
import numpy as np
from gpu import Renderer, Steps
from gpu.bsdf import kernels
RAISES = {{"HAS_ANISOTROPIC": "anisotropic", "HAS_TRANSMISSION": "transmission"}}
up = np.array([[0.0, 0.0, 1.0]])
with Renderer() as renderer:
    for material, flags in kernels.samples():
        if not flags.isdisjoint({LEFT_OUT}):
            continue
        for flag, member in RAISES.items():
            material.materials[member] = 0.5 if flag in flags else 0.0
        Steps(renderer.bsdf.values(material, up, up)).finish()
        Steps(renderer.bsdf.albedo(material, up, 64)).finish()
        Steps(renderer.bsdf.terms(material, up, up)).finish()
"""


class Silent:
    """Renderers that never answer."""

    def __init__(self) -> None:
        self.open_now = 0
        self.order: list[EvaluateBsdf] = []

    def open(self, listener: Any, kind: str, client: str) -> int:
        self.open_now += 1
        return len(self.order)

    def send(self, question: EvaluateBsdf) -> None:
        self.order.append(LONG if question.samples == LONG.samples else SHORT)

    def drop(self, task: int) -> None:
        self.open_now -= 1


@pytest.fixture
def cold(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("MESA_SHADER_CACHE_DIR", str(tmp_path))
    return tmp_path


async def busy_picture(supervisor: Supervisor) -> tuple[int, Ears]:
    """A task that traces without end."""
    ears = Ears()
    task = supervisor.open(ears)
    arrays = pack(parse_scene(SCENE), Shelf()).arrays
    await supervisor.send_scene(Update(task, 1, arrays, SIZE, StopRule()))
    await ears.next_of(task, Loaded)
    return task, ears


def test_pictures_grow_while_its_kernel_is_compiled(gpu: Renderer, cold: Path) -> None:
    async def test(supervisor: Supervisor) -> None:
        task, ears = await busy_picture(supervisor)
        answer = asyncio.ensure_future(BsdfQuestions(supervisor).ask(DEAR))
        seen: list[int] = []
        helped = False
        while not answer.done():
            supervisor.send(Read(task, len(seen), LINEAR))
            seen.append((await ears.next_of(task, Image)).progress.samples)
            helped = helped or bool(compile_helpers(supervisor.process_id))
        assert (await answer)["f"].any()
        assert helped and len(set(seen)) >= 3

    with_supervisor(test)


@pytest.mark.slow
def test_the_foreseen_kernels_are_those_that_are_used(gpu: Renderer, cold: Path) -> None:
    """They come from the driver's disk cache, where another process has put them: nothing is added there."""

    def run(program: str) -> str:
        return subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True).stdout

    if not gpu.info["software"]:
        pytest.skip("other drivers keep their caches elsewhere")
    assert run(AHEAD).strip() == "True"
    before = sum(path.is_file() for path in cold.rglob("*"))
    run(EVALUATOR)
    distinct = {key for key in kernel_keys.bsdf_keys() if not any(dict(key.defines)[flag] for flag in LEFT_OUT)}
    assert sum(path.is_file() for path in cold.rglob("*")) == before >= len(distinct)


def test_who_goes_away_takes_the_question_along(rendering: Rendering) -> None:
    async def test(supervisor: Supervisor) -> None:
        questions = BsdfQuestions(supervisor)
        await questions.ask(SHORT)
        long = asyncio.ensure_future(questions.ask(LONG))
        used = supervisor.statistics.gpu_s
        before = used["bsdf"]
        while used["bsdf"] < before + 0.3:
            assert not long.done()
            await asyncio.sleep(0.05)
        long.cancel()
        with suppress(asyncio.CancelledError):
            await long
        await questions.ask(SHORT)  # the renderer has heard of it by then
        await asyncio.sleep(0.6)  # and has told what it had used
        told = dict(used)
        await asyncio.sleep(0.6)
        assert dict(used) == told

    rendering(test)


def test_a_caller_s_questions_refuse_nobody_else_s() -> None:
    """Nor do long ones refuse short ones, or wait for those of another caller."""

    async def test() -> None:
        renderers = Silent()
        questions = BsdfQuestions(renderers)  # type: ignore[arg-type]
        asked: list[asyncio.Future[Any]] = []

        async def ask(question: EvaluateBsdf, *callers: str) -> list[type[BaseException] | None]:
            """What each of these questions ends with; None where it goes on."""
            mine = [asyncio.ensure_future(questions.ask(question, caller)) for caller in callers]
            asked.extend(mine)
            for _ in range(3):
                await asyncio.sleep(0)
            return [type(each.exception()) if each.done() else None for each in mine]

        assert await ask(LONG, *["anna"] * MOST) == [None] * (MOST // 2) + [TooManyRequests] * (MOST // 2)
        assert renderers.open_now == 1, "one of a caller at a time"
        assert await ask(LONG, "bert") == [None] and renderers.open_now == 2 == LONG_AT_ONCE
        assert await ask(LONG, "carl") == [None] and renderers.open_now == 2
        assert await ask(SHORT, *["anna"] * 33) == [None] * 32 + [TooManyRequests]
        assert await ask(SHORT, *["bert"] * 17) == [None] * 16 + [TooManyRequests]
        assert renderers.open_now == 2 + 48
        asked[0].cancel()
        for _ in range(5):
            await asyncio.sleep(0)
        assert renderers.order[-1] == LONG and renderers.open_now == 2 + 48, "the next long one has its turn"
        for each in asked:
            each.cancel()
        await asyncio.gather(*asked, return_exceptions=True)
        assert renderers.open_now == 0
        assert await ask(SHORT, "anna") == [None]
        asked[-1].cancel()

    asyncio.run(test())
