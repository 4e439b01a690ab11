"""What is read from sound image files."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from service import images
from service.assets import AssetStore
from service.problems import AssetError
from tests import asset_files as make

RNG = np.random.default_rng(11)
PIXELS = RNG.random((8, 16, 3)).astype(np.float32)


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Iterator[AssetStore]:
    store = AssetStore(tmp_path_factory.mktemp("data"))
    yield store
    store.close()


def image_of(store: AssetStore, data: bytes) -> tuple[np.ndarray, bool]:
    read = store.image(store.add(data).id)
    scale = np.float32(255 if read.is_8bit else 1)
    return np.divide(read.pixels, scale, dtype=np.float32), read.is_8bit


def test_exr_as_stored_negative_values_too(store: AssetStore) -> None:
    pixels = PIXELS - 0.5
    read, is_8bit = image_of(store, make.exr(pixels))
    assert np.array_equal(read, pixels) and not is_8bit


def test_exr_data_window_lies_in_the_display_window(store: AssetStore) -> None:
    """Cut where it sticks out on the left and above, black where it does not reach."""
    read, _ = image_of(store, make.exr(PIXELS, (-3, -2, 12, 5)))
    assert read.shape == PIXELS.shape
    assert np.array_equal(read[:6, :13], PIXELS[2:, 3:]) and not read[6:].any() and not read[:, 13:].any()


def test_exr_layers_and_grey(store: AssetStore) -> None:
    grey = PIXELS[..., :1]
    assert np.array_equal(image_of(store, images.encode(grey, "exr"))[0], grey)
    layered = images.encode_layers({"depth": grey, "albedo": PIXELS})
    assert np.array_equal(image_of(store, layered)[0], PIXELS)
    with pytest.raises(AssetError, match=r"no channels R, G and B; it has normal\.X"):
        store.add(images.encode_layers({"normal": PIXELS}))


@pytest.mark.parametrize("size", ["-Y 8 +X 16", "+Y 8 +X 16", "-Y 8 -X 16", "+X 16 -Y 8", "-X 16 +Y 8"])
def test_hdr_is_turned_upright(store: AssetStore, size: str) -> None:
    stored = PIXELS + 0.1
    if size.startswith("+Y") or size.endswith("+Y 8"):
        stored = stored[::-1]
    if "-X" in size:
        stored = stored[:, ::-1]
    if size[1] == "X":
        stored = stored.transpose(1, 0, 2)
    read, is_8bit = image_of(store, make.hdr(stored, size))
    assert not is_8bit and np.abs(read - PIXELS - 0.1).max() < 1 / 128


@pytest.mark.parametrize("channels", [1, 2, 3, 4])
def test_png_of_8_and_16_bits(store: AssetStore, channels: int) -> None:
    for dtype, most in ((np.uint8, 255), (np.uint16, 65535)):
        pixels = RNG.integers(0, most, (5, 7, channels), dtype, endpoint=True)
        if channels == 2:
            expected = np.concatenate([np.repeat(pixels[..., :1], 3, axis=2), pixels[..., 1:]], axis=2)
        else:
            expected = pixels
        read, is_8bit = image_of(store, make.png(pixels))
        assert is_8bit == (most == 255) and np.allclose(read, expected / most, atol=1e-6)


@pytest.mark.parametrize("format", ["jpeg", "webp"])
def test_jpeg_and_webp(store: AssetStore, format: str) -> None:
    flat = np.full((16, 24, 3), (200, 40, 90), np.uint8)
    read, is_8bit = image_of(store, images.encode(flat, format, quality=95))
    assert is_8bit and np.abs(read * 255 - flat).max() < 6
