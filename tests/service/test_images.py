"""Every format is read back by another reader than the library that wrote it."""

from __future__ import annotations

import io
import json
import os
import struct
import zlib
from typing import Any, get_args

import numpy as np
import pytest
from PIL import Image, ImageCms

from service import displays, views
from service.colorimetry import decode_srgb as srgb_to_linear
from service.colorimetry import encode_srgb
from service.formats import images
from service.formats.images import encoders
from service.formats.images.metadata import exr_attributes
from tests.asset_files import png, read_exr, read_hdr, read_png

RNG = np.random.default_rng(3)
METADATA: dict[str, Any] = {"scene": {"materials": {"größe": {}}}, "settings": {"seed": 7}}


def linear(height: int = 21, width: int = 34, channels: int = 4) -> np.ndarray:
    return (RNG.standard_exponential((height, width, channels)) * 3).astype(np.float32)


def smooth(channels: int) -> np.ndarray:
    """Low frequencies, so that lossy formats keep them: uint8, (48, 64, channels)."""
    v, u = np.mgrid[0:48, 0:64] / 64
    ramps = np.stack([u, v, 1 - u, 0.25 + 0.75 * v][:channels], axis=2)
    levels: np.ndarray = np.rint(ramps * 255)
    return levels.astype(np.uint8)


def read_by_openimageio(data: bytes) -> np.ndarray:
    import OpenImageIO as oiio

    fd = os.memfd_create("test")
    try:
        os.write(fd, data)
        config = oiio.ImageSpec()
        config.attribute("oiio:UnassociatedAlpha", 1)
        file: Any = oiio.ImageInput.open(f"/proc/self/fd/{fd}", config)
        return np.asarray(file.read_image("uint8")).reshape(file.spec().height, file.spec().width, -1)
    finally:
        os.close(fd)


def png_chunks(png: bytes) -> dict[bytes, bytes]:
    at, found = 8, {}
    while at < len(png):
        size, kind = struct.unpack_from(">I4s", png, at)
        found[kind], at = png[at + 8 : at + 8 + size], at + 12 + size
    return found


@pytest.mark.parametrize("channels", [1, 3, 4])
def test_png_of_8_bits_keeps_every_byte(channels: int) -> None:
    pixels = RNG.integers(0, 256, (13, 9, channels), np.uint8)
    assert np.array_equal(read_png(images.encode(pixels, "png")), pixels)


def test_png_of_16_bits_keeps_straight_alpha() -> None:
    pixels = RNG.random((7, 11, 4)).astype(np.float32)
    read = read_png(images.encode(pixels, "png", bits=16))
    assert read.dtype.itemsize == 2
    assert np.abs(read - pixels.astype(np.float64) * 65535).max() < 0.51  # rounded; in float32, hence the .01


def test_png_of_16_bits_from_bytes() -> None:
    pixels = RNG.integers(0, 256, (4, 5, 4), np.uint8)
    assert np.array_equal(read_png(images.encode(pixels, "png", bits=16)), pixels.astype(int) * 257)


def test_floats_are_rounded_and_clipped() -> None:
    pixels = np.array([[[-1, 0.5 / 255 - 1e-4, 0.5 / 255 + 1e-4, 2]]], np.float32)
    assert read_png(images.encode(pixels, "png")).tolist() == [[[0, 0, 1, 255]]]


@pytest.mark.parametrize("quality", [None, 80, 95])
def test_jpeg_lies_over_black(quality: int | None) -> None:
    pixels = smooth(4)
    data = images.encode(pixels, "jpeg", quality=quality)
    expected = pixels[..., :3] * (pixels[..., 3:] / 255)
    assert np.abs(read_by_openimageio(data) - expected).mean() < 2


def test_jpeg_keeps_full_colour_from_quality_90() -> None:
    def sampling(quality: int) -> int:
        data = images.encode(smooth(3), "jpeg", quality=quality)
        frame = data.index(b"\xff\xc0")  # the baseline frame's header: the first component's factors at byte 11
        return data[frame + 11]

    assert (sampling(89), sampling(90)) == (0x22, 0x11)


@pytest.mark.parametrize("format", ["webp", "avif"])
def test_lossy_formats_keep_alpha(format: views.FileFormat) -> None:
    pixels = smooth(4)
    read = np.asarray(Image.open(io.BytesIO(images.encode(pixels, format, quality=95))))
    assert np.abs(read[..., 3].astype(int) - pixels[..., 3]).max() <= 1
    assert np.abs(read.astype(float) - pixels).mean() < 3


@pytest.mark.parametrize(("channels", "names"), [(4, "RGBA"), (3, "RGB"), (1, "Y")])
def test_exr_keeps_every_bit(channels: int, names: str) -> None:
    pixels = linear(channels=channels)
    read = read_exr(images.encode(pixels, "exr"))
    assert set(read) == set(names)
    assert np.array_equal(np.stack([read[name] for name in names], axis=2), pixels)


def test_exr_layers_have_the_contract_s_names() -> None:
    sizes = {"depth": 1, "color": 4, "variance": 3, "albedo": 3, "normal": 3}
    layers = {name: linear(channels=n) for name, n in sizes.items()}
    read = read_exr(images.encode_layers(layers, METADATA))
    names = "R G B A albedo.R albedo.G albedo.B normal.X normal.Y normal.Z depth.Z variance.R variance.G variance.B"
    assert sorted(read) == sorted(names.split())
    expected = np.concatenate([layers[n] for n in ("color", "albedo", "normal", "depth", "variance")], axis=2)
    assert np.array_equal(np.stack([read[name] for name in names.split()], axis=2), expected)


def test_hdr_drops_alpha_and_keeps_a_hundredth() -> None:
    pixels = linear()
    read = read_hdr(images.encode(pixels, "hdr"))
    assert read.shape == (21, 34, 3)
    peak = pixels[..., :3].max(axis=2, keepdims=True)
    assert (np.abs(read - pixels[..., :3]) / peak).max() < 1 / 128


def test_exr_tells_no_time() -> None:
    """The same picture is the same file."""
    assert "capDate" not in images.metadata.exr_attributes(images.encode(linear(), "exr", metadata=METADATA))


def test_npy_keeps_every_bit() -> None:
    pixels = linear(channels=3)
    read = np.load(io.BytesIO(images.encode(pixels, "npy")), allow_pickle=False)
    assert read.dtype == np.float32 and np.array_equal(read, pixels)


@pytest.mark.parametrize("channels", [1, 3, 4])
def test_rgba32f_is_always_four_floats(channels: int) -> None:
    pixels = linear(channels=channels)
    read = np.frombuffer(images.encode(pixels, "rgba32f"), np.float32).reshape(*pixels.shape[:2], 4)
    assert np.array_equal(read[..., :3], np.broadcast_to(pixels[..., :3], read[..., :3].shape))
    assert np.array_equal(read[..., 3], pixels[..., 3] if channels == 4 else np.ones(pixels.shape[:2]))


@pytest.mark.parametrize(
    ("format", "bits", "encoding"),
    [("png", 8, "u1"), ("png", 16, "f4"), ("jpeg", 8, "u1"), ("webp", 16, "u1"), ("avif", 8, "u1"),
     ("exr", 16, "linear")],
)  # fmt: skip
def test_a_format_says_what_it_is_written_from(format: views.FileFormat, bits: int, encoding: str) -> None:
    assert images.FORMATS[format].encoding(bits) == encoding


def test_a_plane_without_channels_is_one_channel() -> None:
    assert np.load(io.BytesIO(images.encode(linear()[..., 0], "npy"))).shape == (21, 34, 1)
    assert read_hdr(images.encode(linear()[..., 0], "hdr")).shape == (21, 34, 3)


def test_every_format_is_written() -> None:
    assert set(get_args(views.FileFormat) + get_args(views.StreamFormat)) == set(images.FORMATS)
    for format in images.FORMATS:
        assert images.encode(linear(), format)
    with pytest.raises(ValueError, match="bmp"):
        images.encode(linear(), "bmp")


@pytest.mark.parametrize("bits", [8, 16])
def test_png_carries_metadata(bits: int) -> None:
    data = images.encode(smooth(4), "png", bits=bits, metadata=METADATA)
    assert images.read_metadata(data) == METADATA
    assert read_png(data).shape == (48, 64, 4)
    from PIL import Image

    assert json.loads(Image.open(io.BytesIO(data)).text["sunbox"]) == METADATA  # type: ignore[attr-defined]


def test_exr_carries_metadata() -> None:
    for data in (
        images.encode(linear(), "exr", metadata=METADATA),
        images.encode_layers({"color": linear()}, METADATA),
    ):
        assert images.read_metadata(data) == METADATA


@pytest.mark.parametrize(
    ("encoding", "codes"),
    [(displays.DISPLAY_P3, b"\x0c\x0d\0\1"), (displays.Encoding("p3", 2.6), None),
     (displays.Encoding("rec2020", "pq"), b"\x09\x10\0\1")],
)  # fmt: skip
@pytest.mark.parametrize("bits", [8, 16])
def test_png_says_what_it_stands_for(encoding: displays.Encoding, codes: bytes | None, bits: int) -> None:
    file = images.encode(np.full((2, 2, 4), 0.5, np.float32), "png", bits=bits, metadata=METADATA, encoding=encoding)
    chunks = png_chunks(file)
    assert chunks.get(b"cICP") == codes and (b"iCCP" in chunks) == (encoding.transfer != "pq")
    assert not {b"sRGB", b"gAMA", b"cHRM"} & set(chunks) and images.read_metadata(file) == METADATA
    Image.open(io.BytesIO(file)).load()


@pytest.mark.parametrize("format", ["png", "jpeg", "webp", "avif"])
@pytest.mark.parametrize("encoding", [displays.DISPLAY_P3, displays.Encoding("rec709", 2.2)], ids=str)
def test_profiles_lead_to_the_right_colour(format: views.FileFormat, encoding: displays.Encoding) -> None:
    """Little CMS finds the sRGB values that the matrices of the standards give."""
    shown = np.array([0.8, 0.5, 0.4])
    curve = srgb_to_linear(shown) if encoding.transfer == "srgb" else shown ** float(encoding.transfer)
    to_srgb = np.linalg.inv(encoders.xyz_matrix(encoders.PRIMARIES["rec709"])) @ encoders.xyz_matrix(
        encoders.PRIMARIES[encoding.primaries]
    )
    expected = encode_srgb(to_srgb @ curve) * 255
    pixels = np.broadcast_to(np.float32([*shown, 1]), (16, 16, 4))
    picture = Image.open(io.BytesIO(images.encode(pixels, format, quality=100, encoding=encoding)))
    profile = ImageCms.ImageCmsProfile(io.BytesIO(picture.info["icc_profile"]))
    found = ImageCms.profileToProfile(picture.convert("RGB"), profile, ImageCms.createProfile("sRGB"))
    assert found is not None and np.abs(np.asarray(found)[8, 8] - expected).max() < 2.5
    assert "icc_profile" not in Image.open(io.BytesIO(images.encode(pixels, format))).info


def test_exr_says_its_primaries() -> None:
    found = exr_attributes(images.encode(linear(), "exr"))
    assert struct.unpack("<8f", found["chromaticities"]) == pytest.approx(
        [0.64, 0.33, 0.3, 0.6, 0.15, 0.06, 0.3127, 0.329]
    )
    assert found["colorInteropID"] == b"lin_rec709_scene"


def test_other_text_chunks_are_read() -> None:
    plain = images.encode(smooth(3), "png")
    text = json.dumps(METADATA, ensure_ascii=False).encode()
    for kind, body in (
        (b"iTXt", b"sunbox\0\0\0de\0\0" + text),
        (b"iTXt", b"sunbox\0\1\0de\0\0" + zlib.compress(text)),
        (b"zTXt", b"sunbox\0\0" + zlib.compress(json.dumps(METADATA).encode())),
    ):
        chunk = len(body).to_bytes(4, "big") + kind + body + zlib.crc32(kind + body).to_bytes(4, "big")
        assert images.read_metadata(plain[:33] + chunk + plain[33:]) == METADATA


def test_files_without_metadata_have_none() -> None:
    foreign = images.metadata.png_with_text(images.encode(smooth(3), "png"), "no JSON")
    listed = images.metadata.png_with_text(images.encode(smooth(3), "png"), "[1]")
    whole = images.encode(linear(), "exr", metadata=METADATA)
    for data in (
        png(smooth(3)),
        images.encode(linear(), "exr"),
        foreign,
        listed,
        b"",
        b"\x89PNG\r\n\x1a\n",
        b"hello",
    ):
        assert images.read_metadata(data) is None
    for end in range(0, len(whole) - len(whole) // 2, 7):
        images.read_metadata(whole[:end])  # cut anywhere: never an exception
