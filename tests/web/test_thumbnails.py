"""Pictures of materials: those of the library are files, those of saved and edited ones are never grey."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest
from playwright.sync_api import Browser, Page

from tests.bench import thumbnail_stages as stages
from tests.serving import Server

# `work(thumbnails, image, wait)` with the module's class; `wait(isSo)` until that is so.
RUN = """async ([work, given]) => {{
    const {{ Thumbnails }} = await import(new URL("forms/thumbnails.js", location));
    const image = document.body.insertBefore(new Image(48, 48), document.body.firstChild);
    const wait = async (isSo) => {{
        for (let turn = 0; turn < 400 && !isSo(); turn++) await new Promise((then) => setTimeout(then, 10));
        return isSo();
    }};
    const thumbnails = new Thumbnails(() => false, Promise.resolve());
    try {{
        return await ({work})(thumbnails, image, wait, given);
    }} finally {{
        image.remove();
    }}
}}"""


@pytest.fixture(scope="module")
def page(browser: Browser, server: Server) -> Iterator[Page]:
    """A page of text: on that of the other modules' tests, a drawing, no image comes into sight."""
    opened = browser.new_page()
    opened.goto(f"{server.url}/keys.js")
    yield opened
    opened.close()


def run(page: Page, work: str, given: Any = None) -> Any:
    return page.evaluate(RUN.format(work=work), [None, given])


def test_edited_materials_stand_on_the_stage_of_the_presets(page: Page) -> None:
    script = """async () => (await import(new URL("forms/thumbnail-rendering.js", location))).studio()"""
    assert page.evaluate(script) == stages.ball()


@pytest.mark.parametrize("name", ["gold", "physically-based-wine-red"])
def test_a_preset_is_a_file_that_is_there(page: Page, name: str) -> None:
    work = """async (thumbnails, image, wait, name) => {
        await thumbnails.preset(image, name, () => { throw new Error("asked for"); });
        return (await wait(() => image.naturalWidth > 1)) && [image.src, image.naturalWidth];
    }"""
    source, width = run(page, work, name)
    assert source.endswith(f"/thumbnails/{name}.webp") and width == 144


def test_a_preset_without_a_file_is_a_ball_until_it_is_rendered(page: Page) -> None:
    work = """async (thumbnails, image, wait) => {
        await thumbnails.preset(image, "nobody", async () => ({ type: "diffuse", albedo: 0.5 }));
        return wait(() => image.src.startsWith("blob:") && image.naturalWidth > 1);
    }"""
    assert run(page, work)


def test_a_material_as_the_library_has_it_shows_the_librarys_picture(page: Page) -> None:
    work = """async (thumbnails, image, wait) => {
        const jade = { type: "principled", base_color: { texture: "clouds" }, roughness: 0.1 };
        const textures = { clouds: { type: "noise", seed: 3 } };
        thumbnails.knows("jade", { materials: { jade }, textures });
        await thumbnails.own(image, { materials: { subject: { ...jade } }, textures }, true);
        const same = image.src;
        await thumbnails.own(image, { materials: { subject: { ...jade, roughness: 0.2 } }, textures }, true);
        await wait(() => image.src !== same);
        const other = image.src;
        await thumbnails.own(image, { materials: { subject: jade }, textures }, true);
        return [same, other, image.src];
    }"""
    same, other, again = run(page, work)
    assert same.endswith("/thumbnails/jade.webp") and again == same
    assert other.startswith("blob:")


def test_a_saved_material_shows_the_stage_at_once(page: Page) -> None:
    """And keeps it when the material itself comes, until that is rendered."""
    work = """async (thumbnails, image, wait) => {
        const stage = new OffscreenCanvas(60, 30);
        const context = stage.getContext("2d");
        for (const [color, left] of [["#f00", 0], ["#0f0", 15], ["#00f", 45]]) {
            context.fillStyle = color;
            context.fillRect(left, 0, 60, 30);
        }
        let isFetched = false;
        thumbnails.saved(image, async () => { isFetched = true; return { type: "diffuse", albedo: 0.5 }; });
        await thumbnails.atOnce(image, stage);
        const shown = image.src;
        await wait(() => isFetched);
        await new Promise((then) => setTimeout(then, 50));
        await wait(() => image.naturalWidth > 1);
        const small = new OffscreenCanvas(3, 1).getContext("2d");
        small.drawImage(image, 0, 0, 3, 1);
        return [image.src === shown, image.naturalWidth, [...small.getImageData(1, 0, 1, 1).data]];
    }"""
    is_kept, width, middle = run(page, work)
    assert is_kept and width == 144
    assert middle[1] > 200 and max(middle[0], middle[2]) < 80, "the middle of the stage"
