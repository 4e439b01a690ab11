"""Many pictures on one, and one after the other."""

from __future__ import annotations

import shutil
import subprocess
import threading
from collections.abc import Iterable
from pathlib import Path

import numpy as np
import pytest
from PIL import Image, ImageSequence

from service.formats.images import animation
from service.formats.images.animation import Animator, Frames, NoEncoder
from service.formats.images.contact_sheet import EMPTY, PAPER, ContactSheet

COLOURS = [(200, 30, 30), (30, 200, 30), (30, 30, 200), (200, 200, 30), (30, 200, 200), (200, 30, 200)]


def picture(k: int, size: tuple[int, int] = (64, 48)) -> Image.Image:
    return Image.new("RGB", size, COLOURS[k % len(COLOURS)])


def frames_of(folder: Path, pictures: Iterable[Image.Image]) -> Frames:
    spool = folder / "spool"
    with spool.open("wb") as file:
        for each in pictures:
            file.write(each.tobytes())
            size = each.size
    return Frames(spool, size)


def blocks(sheet: Image.Image, colour: tuple[int, int, int]) -> list[int]:
    """x and y of the first pixel of a colour, and how many there are."""
    rows, columns = np.nonzero((np.asarray(sheet) == colour).all(axis=2))
    return [int(columns.min()), int(rows.min()), len(rows)] if len(rows) else []


def test_table_has_each_picture_in_its_place() -> None:
    sheet = ContactSheet((64, 48), ["a 1", "a 2", "a 3"], ["b 1", "b 2"], ["/materials/a"])
    drawn = sheet.drawn(picture, lambda k: "queued")
    found = [blocks(drawn, colour) for colour in COLOURS]
    assert drawn.size == sheet.size and [area for *_, area in found] == [64 * 48] * 6
    assert (
        found[0][1] == found[1][1] == found[2][1] < found[3][1]
        and found[0][0] == found[3][0] < found[1][0] < found[2][0]
    )
    assert drawn.getpixel((drawn.width - 1, drawn.height - 1)) == PAPER


def test_list_is_set_in_lines() -> None:
    sheet = ContactSheet((64, 48), [f"roughness {k}" for k in range(6)])
    found = [blocks(sheet.drawn(picture, str), colour) for colour in COLOURS]
    assert found[0][1] == found[2][1] < found[3][1] == found[5][1] and found[0][0] == found[3][0]


def test_missing_picture_leaves_its_place() -> None:
    drawn = ContactSheet((64, 48), ["one", "two"]).drawn(lambda k: picture(0) if k else None, lambda k: "queued")
    left, _, area = blocks(drawn, EMPTY)
    assert 0.8 * 64 * 48 < area < 64 * 48 and left < blocks(drawn, COLOURS[0])[0]


def test_larger_pictures_are_scaled_down_and_long_names_cut() -> None:
    sheet = ContactSheet((32, 24), ["a very long name that no picture is wide enough for"] * 2, ["x" * 400])
    drawn = sheet.drawn(lambda k: picture(k, (640, 480)), str)
    assert drawn.size == sheet.size and drawn.width < 32 * 4 + 60 and blocks(drawn, COLOURS[0])[2] == 32 * 24


@pytest.mark.parametrize("format", ["apng", "webp", "gif", "avif"])
def test_animations_have_all_frames(tmp_path: Path, format: animation.AnimationFormat) -> None:
    path = tmp_path / "a"
    animation.write(path, frames_of(tmp_path, (picture(k) for k in range(5))), format, fps=20)
    with Image.open(path) as made:
        frames = [np.asarray(frame.convert("RGB")).mean(axis=(0, 1)) for frame in ImageSequence.Iterator(made)]
        assert made.size == (64, 48) and made.n_frames == 5
    assert np.abs(np.array(frames) - np.array(COLOURS[:5])).max() < 8


@pytest.mark.parametrize("format", animation.FORMATS)
def test_single_picture_is_an_animation_too(tmp_path: Path, format: animation.AnimationFormat) -> None:
    if format == "mp4" and shutil.which("ffmpeg") is None:
        pytest.skip("no ffmpeg here")
    animation.write(tmp_path / "a", frames_of(tmp_path, [picture(0, (31, 17))]), format, fps=1)
    assert (tmp_path / "a").stat().st_size > 0


def test_mp4_needs_ffmpeg(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(NoEncoder, match="ffmpeg"):
        animation.write(tmp_path / "a", frames_of(tmp_path, [picture(0)]), "mp4", fps=1)


def test_ffmpegs_reason_is_given(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    program = tmp_path / "ffmpeg"
    program.write_text("#!/bin/sh\ncat >/dev/null\necho 'Unknown encoder libx264' >&2\nexit 1\n")
    program.chmod(0o755)
    monkeypatch.setattr(shutil, "which", lambda name: str(program))
    with pytest.raises(OSError, match="Unknown encoder"):
        animation.write(tmp_path / "a", frames_of(tmp_path, [picture(0)]), "mp4", fps=1)


def test_mp4_plays_at_its_rate(tmp_path: Path) -> None:
    if shutil.which("ffmpeg") is None or shutil.which("ffprobe") is None:
        pytest.skip("no ffmpeg here")
    animation.write(tmp_path / "a.mp4", frames_of(tmp_path, (picture(k, (65, 49)) for k in range(6))), "mp4", fps=3)
    probe = ["ffprobe", "-v", "error", "-show_entries", "stream=width,height,nb_frames,duration", "-of", "csv=p=0"]
    said = subprocess.run([*probe, str(tmp_path / "a.mp4")], capture_output=True, text=True).stdout
    assert said.strip() == "66,50,2.000000,6"


@pytest.mark.parametrize("format", ["apng", "webp", "gif", "avif"])
def test_one_frame_is_in_memory_at_a_time(
    tmp_path: Path, format: animation.AnimationFormat, monkeypatch: pytest.MonkeyPatch
) -> None:
    """However many there are."""
    frames, live = frames_of(tmp_path, (picture(k) for k in range(40))), list[int]()
    seek = Frames.seek

    def counting(self: Frames, frame: int) -> None:
        seek(self, frame)
        blocks = Image.core.get_stats()  # type: ignore[attr-defined]
        live.append(blocks["allocated_blocks"] - blocks["freed_blocks"] - blocks["blocks_cached"])

    monkeypatch.setattr(Frames, "seek", counting)
    animation.write(tmp_path / "a", frames, format, fps=20)
    assert len(live) >= 40 and max(live[1:]) <= min(live[1:]) + 2


def test_an_animation_ends_when_nobody_waits_for_it(tmp_path: Path) -> None:
    frames = frames_of(tmp_path, (picture(k, (640, 480)) for k in range(200)))
    animator = Animator(tmp_path / "spool", frames.size, 200, "gif", 20)
    with (tmp_path / "a").open("wb") as file:
        threading.Timer(0.5, animator.stop).start()
        with pytest.raises(OSError, match=r"could not be written|nobody waits"):
            animator.write(file)


def test_an_animation_has_a_bound_of_memory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    size = frames_of(tmp_path, [picture(k, (1024, 1024)) for k in range(4)]).size
    monkeypatch.setattr("service.formats.images.animation.SLACK", 0)
    monkeypatch.setattr("service.formats.images.animation.most_memory", lambda size, pictures: 0)
    animator = Animator(tmp_path / "spool", size, 4, "webp", 20)
    with (tmp_path / "a").open("wb") as file, pytest.raises(OSError, match="could not be written"):
        animator.write(file)
