"""What is read from sound image files."""

from __future__ import annotations

import io
from collections.abc import Iterator
from typing import Any

import numpy as np
import OpenImageIO as oiio
import pytest
from PIL import Image, ImageCms

from service.formats import ImageData, images
from service.problems import AssetError
from service.server.assets import AssetStore
from tests import asset_files as make
from tests.documents import Shelf, packed, sphere
from tests.exr_files import saved, written, written_parts

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


def pillow(image: Image.Image, format: str, **more: Any) -> bytes:
    file = io.BytesIO()
    image.save(file, format, **more)
    return file.getvalue()


SMALL = RNG.integers(0, 256, (4, 6, 4), np.uint8)


@pytest.mark.parametrize("size", [(1, 1), (1, 6), (4, 1)])
@pytest.mark.parametrize("format", ["png", "webp", "exr", "hdr"])
def test_the_thinnest_images(store: AssetStore, format: str, size: tuple[int, int]) -> None:
    texels = SMALL[: size[0], : size[1], :3]
    if format in ("png", "webp"):
        data, expected = (
            pillow(Image.fromarray(texels), format, **({"lossless": True} if format == "webp" else {})),
            texels,
        )
    else:
        data, expected = (
            (make.exr if format == "exr" else make.hdr)(texels.astype(np.float32) + 1),
            texels.astype(float) + 1,
        )
    read = store.image(store.add(data).id).pixels
    assert read.shape == texels.shape and np.allclose(read, expected, atol=1.1)


def test_png_of_few_colours_and_of_few_bits(store: AssetStore) -> None:
    """Palettes, with and without a transparent entry; greys of one, two and four bits; a transparent colour."""
    palette = Image.fromarray(SMALL[..., :3]).quantize(6)
    seen = np.asarray(palette.convert("RGB"))
    assert np.array_equal(store.image(store.add(pillow(palette, "PNG")).id).pixels, seen)
    clear = store.image(store.add(pillow(palette, "PNG", transparency=2)).id).pixels
    assert np.array_equal(clear[..., :3], seen)
    assert np.array_equal(clear[..., 3] == 0, np.asarray(palette) == 2) and (clear[..., 3] == 0).any()
    for bits, row, expected in ((1, 0b01, [0, 255]), (2, 0b0110, [85, 170]), (4, 0x0F, [0, 255])):
        read = store.image(store.add(make.low_png([row << 8 - 2 * bits], 2, bits)).id).pixels
        assert read.shape == (1, 2, 1) and read.reshape(-1).tolist() == expected, bits
    color = tuple(int(v) for v in SMALL[1, 2, :3])
    keyed = store.image(store.add(pillow(Image.fromarray(SMALL[..., :3]), "PNG", transparency=color)).id).pixels
    assert keyed[1, 2, 3] == 0 and (keyed[..., 3] == 0).sum() == 1


def test_jpeg_of_other_kinds(store: AssetStore) -> None:
    flat = Image.fromarray(np.full((16, 24, 3), (200, 40, 90), np.uint8))
    grey = store.image(store.add(pillow(flat.convert("L"), "JPEG", quality=95)).id).pixels
    assert grey.shape == (16, 24, 1) and abs(int(grey[3, 3, 0]) - 94) < 3
    for image, more in ((flat.convert("CMYK"), {}), (flat, {"progressive": True})):
        read = store.image(store.add(pillow(image, "JPEG", quality=95, **more)).id).pixels
        assert read.shape == (16, 24, 3) and np.abs(read - np.array([200, 40, 90.0])).max() < 6


def told(store: AssetStore, data: bytes) -> tuple[np.ndarray, list[str]]:
    info = store.add(data)
    warnings = [warning["detail"] for warning in info.warnings or []]
    assert list(store.image(info.id).warnings) == warnings
    return store.image(info.id).pixels, warnings


def test_what_an_image_says_beside_its_texels_is_told_and_not_followed(store: AssetStore) -> None:
    image, exif = Image.fromarray(SMALL[..., :3]), Image.Exif()
    exif[0x0112] = 6  # as a phone held upright writes it
    for format, more in (("PNG", {}), ("WEBP", {"lossless": True}), ("JPEG", {"quality": 100, "subsampling": 0})):
        pixels, warnings = told(store, pillow(image, format, exif=exif, **more))
        assert pixels.shape == (4, 6, 3) and np.abs(pixels - SMALL[..., :3].astype(int)).max() < 60
        assert warnings == ["its EXIF orientation (6) is not followed: texels are used as they are stored"]
    frames = [Image.fromarray(np.full((4, 4, 3), c, np.uint8)) for c in (10, 200, 90)]
    for format in ("PNG", "WEBP"):
        pixels, warnings = told(
            store, pillow(frames[0], format, save_all=True, append_images=frames[1:], lossless=True)
        )
        assert pixels.shape == (4, 4, 3) and (pixels == 10).all()
        assert warnings == ["it moves: the first of its 3 frames is shown"]
    srgb = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()
    assert told(store, pillow(image, "PNG", icc_profile=srgb))[1] == []
    other = ImageCms.ImageCmsProfile(ImageCms.createProfile("LAB")).tobytes()
    assert told(store, pillow(image, "PNG", icc_profile=other))[1] == [
        "its colour profile is not sRGB, and is not followed"
    ]
    (warning,) = told(store, make.low_png([0, 128], 2, 8, gamma=1.0))[1]
    assert warning.startswith("its gamma (1) is not followed")


def test_headers_of_floats_are_told_of_too(store: AssetStore) -> None:
    plain = make.hdr(PIXELS + 0.1)
    for line, warnings in (
        (b"EXPOSURE=          1.0000000000000\nPRIMARIES=0.640 0.330 0.290 0.600 0.150 0.060 0.333 0.333\n", []),
        (b"EXPOSURE= 2.5\nCOLORCORR=1 .9 1\n",
         ["its EXPOSURE (2.5) is not followed", "its COLORCORR (1 .9 1) is not followed"]),
        (b"PRIMARIES=0.7 0.3 0.2 0.8 0.1 0.05 0.3 0.3\n",
         ["its PRIMARIES (0.7 0.3 0.2 0.8 0.1 0.05 0.3 0.3) is not followed"]),
        (b"EXPOSURE=e\n", ["its EXPOSURE (e) is not followed"]),
    ):  # fmt: skip
        assert told(store, plain.replace(b"FORMAT", line + b"FORMAT"))[1] == warnings
    for chromaticities, warnings in (
        ((0.64, 0.33, 0.3, 0.6, 0.15, 0.06, 0.3127, 0.329), []),
        ((0.7347, 0.2653, 0, 1, 0.0001, -0.077, 0.32168, 0.33767),  # ACES
         ["its chromaticities are not those of Rec.709, and are not followed"]),
    ):  # fmt: skip
        spec = oiio.ImageSpec(4, 4, 3, "float")
        spec.attribute("chromaticities", "float[8]", chromaticities)
        assert told(store, saved([spec], [PIXELS[:4, :4]]))[1] == warnings


def test_a_render_repeats_what_is_told_of_its_images() -> None:
    image = ImageData(SMALL[..., :3], ("odd",))
    textured = {
        "textures": {"a/b": {"asset": "sha256:t"}},
        "materials": {"grey": {"type": "diffuse", "albedo": {"texture": "a/b"}}},
    }
    shown = packed(sphere(), assets=Shelf(t=image), **textured)
    assert shown.warnings == ["/textures/a~1b/asset: odd"]
    sky = packed(sphere(), assets=Shelf(t=image), environment={"type": "image", "asset": "sha256:t"})
    assert sky.warnings == ["/environment/asset: odd"]


@pytest.mark.parametrize("names", [("r", "g", "b"), ("Red", "Green", "Blue"), ("beauty.R", "beauty.G", "beauty.B")])
def test_exr_names_of_channels(store: AssetStore, names: tuple[str, ...]) -> None:
    assert np.array_equal(image_of(store, written(PIXELS, names))[0], PIXELS)
    more = np.concatenate([PIXELS[..., :1], PIXELS], axis=2)
    alpha = names[0][:-1] + "A" if "." in names[0] else "alpha"
    assert np.array_equal(image_of(store, written(more, (alpha, *names)))[0], more[..., [1, 2, 3, 0]])


@pytest.mark.parametrize("dtype", ["half", "float", "uint32"])
@pytest.mark.parametrize("tile", [0, 16])
def test_exr_of_every_type_in_rows_and_tiles(store: AssetStore, dtype: str, tile: int) -> None:
    whole = np.floor(RNG.random((20, 40, 3)) * 100).astype(np.float32)
    assert np.array_equal(image_of(store, written(whole, "RGB", dtype, tile))[0], whole)


def test_exr_of_several_parts_shows_the_coloured_one(store: AssetStore) -> None:
    depth, normal = ("depth", PIXELS[..., :1], ("Z",)), ("n", PIXELS, ("N.X", "N.Y", "N.Z"))
    for parts in ([depth, normal, ("rgb", PIXELS, "RGB")], [("rgb", PIXELS, "RGB"), depth]):
        assert np.array_equal(image_of(store, written_parts(parts))[0], PIXELS)
    grey = ("grey", PIXELS[..., :1], ("Y",))
    assert np.array_equal(image_of(store, written_parts([normal, depth, grey]))[0], PIXELS[..., :1])
    with pytest.raises(AssetError, match=r"no channels R, G and B; it has N\.X, N\.Y, N\.Z, Z: data, not a picture"):
        store.add(written_parts([normal, depth]))


def test_exr_whose_windows_don_t_meet_is_refused(store: AssetStore) -> None:
    for window in ((100, 0, 115, 7), (-20, 0, -5, 7), (0, 8, 15, 15), (0, -8, 15, -1)):
        with pytest.raises(AssetError, match="data window lies outside of its display window"):
            store.add(make.exr(PIXELS, window))
