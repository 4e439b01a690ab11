"""PNGs whose remarks are damaged, long or about other colours; JPEGs of several pictures."""

from __future__ import annotations

import io
import struct
import zlib

import numpy as np
import pytest
from PIL import Image

from service.problems import AssetError
from service.server.assets import AssetStore
from tests import asset_files as make
from tests.obj_files import TEXTURED, zipped

HEADER = 33  # bytes of the signature and the first chunk
SMALL = np.random.default_rng(5).integers(0, 256, (4, 6, 3), np.uint8)
RED = [64000, 33000, 30000, 60000, 15000, 6000]  # x and y of sRGB's primaries


def chunk(kind: bytes, data: bytes, is_sound: bool = True) -> bytes:
    checksum = zlib.crc32(kind + data) ^ (not is_sound)
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", checksum)


def with_chunks(png: bytes, *chunks: bytes) -> bytes:
    return png[:HEADER] + b"".join(chunks) + png[HEADER:]


def read(store: AssetStore, data: bytes) -> tuple[np.ndarray, list[str]]:
    info = store.add(data)
    return store.image(info.id).pixels, [warning["detail"] for warning in info.warnings or []]


LONG = b"Comment\0\0" + zlib.compress(bytes(30 << 20))
HARMLESS = {
    "a damaged profile": chunk(b"iCCP", b"x\0\0" + zlib.compress(b"?"), is_sound=False),
    "a damaged text": chunk(b"tEXt", b"a\0b", is_sound=False),
    "a long text": chunk(b"zTXt", LONG),
    "primaries of sRGB": chunk(b"cHRM", struct.pack(">8I", 31270, 32900, *RED)),
    "codes of sRGB": chunk(b"cICP", bytes([1, 13, 0, 1])),
    "a frame that is not there": chunk(b"acTL", struct.pack(">II", 2, 0)),
}


@pytest.mark.parametrize("name", HARMLESS)
@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_remarks_refuse_no_picture(store: AssetStore, name: str, dtype: type) -> None:
    plain = make.png(SMALL.astype(dtype))
    found, warnings = read(store, with_chunks(plain, HARMLESS[name]))
    assert np.array_equal(found, read(store, plain)[0])
    assert [warning.startswith("it moves") for warning in warnings] == ([True] if "frame" in name else [])


def test_a_texture_of_a_model_may_have_such_remarks(store: AssetStore) -> None:
    image = with_chunks(make.png(SMALL), HARMLESS["a damaged profile"], HARMLESS["a long text"])
    files = {"a.obj": TEXTURED, "m.mtl": "newmtl m\nbump t.png\nmap_d t.png\n", "t.png": image}
    assert store.add(zipped(files)).kind == "scene"


EXIF = b"MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0\x06" + bytes(6)
TOLD = {
    "its EXIF orientation (6)": chunk(b"eXIf", EXIF),
    "its colour profile is not sRGB": chunk(b"iCCP", b"x\0\0" + zlib.compress(b"Adobe RGB (1998)")),
    "its gamma (0.55) is not followed": chunk(b"gAMA", struct.pack(">I", 55000)),
    "its colours are not sRGB (cICP 12, 13)": chunk(b"cICP", bytes([12, 13, 0, 1])),
    "its colours are not sRGB (cICP 9, 16)": chunk(b"cICP", bytes([9, 16, 0, 1])),
    "its primaries (cHRM) are not": chunk(
        b"cHRM", struct.pack(">8I", 31270, 32900, *RED[:2], 21000, 71000, *RED[4:])
    ),
}


@pytest.mark.parametrize("said", TOLD)
@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_what_is_not_followed_is_told_of_8_and_of_16_bits(store: AssetStore, said: str, dtype: type) -> None:
    plain = make.png(SMALL.astype(dtype))
    found, (warning,) = read(store, with_chunks(plain, TOLD[said]))
    assert warning.startswith(said) and np.array_equal(found, read(store, plain)[0])


def test_damaged_texels_are_told(store: AssetStore) -> None:
    plain = make.png(SMALL)
    begin = plain.index(b"IDAT")
    end = begin + 4 + int.from_bytes(plain[begin - 4 : begin], "big")
    found, warnings = read(store, plain[:end] + b"\0\0\0\0" + plain[end + 4 :])
    assert np.array_equal(found, SMALL) and warnings == ["a checksum of its texels is wrong: they may be damaged"]
    with pytest.raises(AssetError, match="cut off"):
        store.add(plain[: end - 3])


@pytest.mark.parametrize("bits", [1, 2, 4, 8])
def test_the_transparent_one_of_few_greys(store: AssetStore, bits: int) -> None:
    """Its number is one of the file's, of so many bits."""
    most = (1 << bits) - 1
    row = {1: 0b00100000, 2: 0b00110001, 4: 0x0F, 8: 0}[bits]
    texels = [row >> 8 - bits * (k + 1) & most for k in range(8 // bits)]
    for clear in {*texels}:
        key = chunk(b"tRNS", struct.pack(">H", clear))
        found, _ = read(store, with_chunks(make.low_png([row], len(texels), bits), key))
        assert found[0, :, 3].tolist() == [0 if texel == clear else 255 for texel in texels]
        assert found[0, :, 0].tolist() == [texel * 255 // most for texel in texels]


def test_a_jpeg_of_several_pictures_does_not_move(store: AssetStore) -> None:
    """As phones write it, with the map of its highlights."""
    file, images = io.BytesIO(), [Image.fromarray(np.full((8, 8, 3), c, np.uint8)) for c in (200, 10)]
    images[0].save(file, "MPO", save_all=True, append_images=images[1:])
    found, warnings = read(store, file.getvalue())
    assert np.abs(found.astype(int) - 200).max() < 4
    assert warnings == ["it holds 2 pictures: the first one is shown"]
