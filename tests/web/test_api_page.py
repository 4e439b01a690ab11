"""The tasks of docs/api.md in JavaScript, in a page of the server and in Node, without any package."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from typing import Any

import pytest
from playwright._impl._driver import compute_driver_executable
from playwright.sync_api import Page

from tests.api_page import tasks
from tests.serving import Server

# What is looked at after a task: an expression over what it declares.
RESULTS = {
    1: "[picture.type, (await createImageBitmap(picture)).width]",
    2: "[bright.type, (await createImageBitmap(bright)).width]",
    3: "[asset.triangles, (await createImageBitmap(tetra)).width]",
    4: "[status.state, (await createImageBitmap(patched)).width]",
    5: "[depth.length, Math.max(...depth) > 4, layers.type]",
    6: "[status.state, status.samples, (await createImageBitmap(poster)).width]",
    7: "[generation, last.samples, last.reason]",
    8: "[status.counts.done, (await createImageBitmap(sheet)).width > 3 * 96]",
    9: "[bsdf.f[0].length, bsdf.pdf[0].length]",
    10: "JSON.stringify(again) === JSON.stringify(scene)",
}
EXPECTED: dict[int, Any] = {
    1: ["image/png", 512],
    2: ["image/jpeg", 160],
    3: [4, 160],
    4: ["done", 160],
    5: [160 * 120, True, "image/x-exr"],
    6: ["done", 64, 160],
    7: [2, 64, "max_samples"],
    8: [6, True],
    9: [2, 2],
    10: True,
}


@pytest.mark.parametrize("number", RESULTS)
def test_task(page: Page, server: Server, number: int) -> None:
    code = tasks("js")
    shared = code[0].replace("http://127.0.0.1:8000", server.url)
    assert shared != code[0]
    program = f"async () => {{ {shared}\n{{ {code[number]}\n return {RESULTS[number]}; }} }}"
    assert page.evaluate(program) == EXPECTED[number]


def test_all_tasks_in_node(server: Server, tmp_path: Path) -> None:
    """By the Node that Playwright brings along. There are no bitmaps: a picture's bytes are looked at."""
    code = tasks("js")
    parts = [code[0].replace("http://127.0.0.1:8000", server.url), "const told = {};"]
    parts.append("const createImageBitmap = async (blob) => { const view = new DataView(await blob.arrayBuffer());")
    parts.append('  return { width: blob.type === "image/png" ? view.getUint32(16) : null }; };')
    parts += [f"{{ {code[number]}\n told[{number}] = {result}; }}" for number, result in RESULTS.items()]
    (tmp_path / "tasks.mjs").write_text("\n".join([*parts, "process.stderr.write(JSON.stringify(told));"]))
    node = compute_driver_executable()[0]
    done = subprocess.run([node, tmp_path / "tasks.mjs"], capture_output=True, text=True)
    told = {int(number): value for number, value in json.loads(done.stderr).items()}
    assert told == EXPECTED | {2: ["image/jpeg", None]}, done.stderr
