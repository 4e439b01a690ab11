"""Radiance files with flat scan lines and with the older run lengths."""

from __future__ import annotations

import numpy as np
import pytest

from service.problems import AssetError
from service.server.assets import AssetStore

HEAD = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n"
RNG = np.random.default_rng(3)


def floats(rgbe: np.ndarray) -> np.ndarray:
    scale = np.where(rgbe[..., 3:] > 0, 2.0 ** (rgbe[..., 3:].astype(float) - 136), 0)
    return (rgbe[..., :3] * scale).astype(np.float32)


def runs(row: np.ndarray) -> bytes:
    """A line in the older run lengths: 1 1 1 n repeats the texel before n times, further counts have 8 bits more."""
    out, at = bytearray(), 0
    while at < len(row):
        end = at + 1
        while end < len(row) and (row[end] == row[at]).all():
            end += 1
        out += row[at].tobytes()
        more = end - at - 1
        while more:
            out += bytes((1, 1, 1, more & 255))
            more >>= 8
        at = end
    return bytes(out)


def file(lines: list[bytes], size: str) -> bytes:
    return HEAD + size.encode() + b"\n" + b"".join(lines)


def picture(height: int, width: int) -> np.ndarray:
    """Mostly runs, of up to a whole line; no texel is 1 1 1, which would be a run."""
    colours = RNG.integers(2, 255, (7, 4), np.uint8)
    colours[:, 3] = RNG.integers(120, 140, 7)
    colours[0, 3] = 0  # black
    places = np.sort(RNG.integers(0, 7, (height, width)), axis=1)
    places[0] = 4
    return colours[places]


@pytest.mark.parametrize("shape", [(1, 1), (3, 5), (8, 16), (4, 700), (2, 70_000)])
def test_the_older_run_lengths(store: AssetStore, shape: tuple[int, int]) -> None:
    rgbe = picture(*shape)
    for lines in ([runs(row) for row in rgbe], [row.tobytes() for row in rgbe]):
        info = store.add(file(lines, f"-Y {shape[0]} +X {shape[1]}"))
        assert info.warnings is None and np.array_equal(store.image(info.id).pixels, floats(rgbe))


def test_they_are_turned_as_other_lines(store: AssetStore) -> None:
    rgbe = picture(6, 9)
    for size, stored in (
        ("+Y 6 +X 9", rgbe[::-1]),
        ("-Y 6 -X 9", rgbe[:, ::-1]),
        ("+X 9 -Y 6", rgbe.transpose(1, 0, 2)),
        ("-X 9 +Y 6", rgbe[::-1, ::-1].transpose(1, 0, 2)),
    ):
        info = store.add(file([runs(np.ascontiguousarray(line)) for line in stored], size))
        assert np.array_equal(store.image(info.id).pixels, floats(rgbe)), size


def test_what_they_cannot_hold_is_refused(store: AssetStore) -> None:
    rgbe = picture(4, 40)
    whole = file([runs(row) for row in rgbe], "-Y 4 +X 40")
    for cut in (1, 5, 20):
        with pytest.raises(AssetError, match=r"the file is cut off: it has \d+ of 160 texels"):
            store.add(whole[:-cut])
    with pytest.raises(AssetError, match="begins with a run length, and has no texel to repeat"):
        store.add(file([b"\1\1\1\5" + rgbe.tobytes()], "-Y 4 +X 40"))
    with pytest.raises(AssetError, match="XYZ"):
        store.add(whole.replace(b"rgbe", b"xyze"))
    many = file([rgbe[0, :1].tobytes() + b"\1\1\1\xff" * 9], "-Y 4 +X 40")  # a count of 72 bits
    assert (store.image(store.add(many).id).pixels == floats(rgbe[0, :1])).all()
