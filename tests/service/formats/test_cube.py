"""Tables of colours: what .cube files may say, and what a picture becomes of them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from service.formats.cache import as_lut
from service.formats.errors import ParseError
from service.formats.formats import sniff
from service.formats.read.cube import parse_cube
from service.problems import AssetError
from service.server.assets import AssetStore
from tests.asset_files import png

CURVES = b'# by hand\nTITLE "a # b"\n\nLUT_1D_SIZE 3\nDOMAIN_MAX 1 2 4\n0 0 0\n.5 +1 1e-1\n1 1 1\n'


def cube(side: int) -> np.ndarray:
    return np.random.default_rng(1).random((side, side, side, 3)).astype(np.float32)


def written(table: np.ndarray) -> bytes:
    rows = [" ".join(map(repr, map(float, row))) for row in table.reshape(-1, 3)]
    axes = table.ndim - 1
    return "\r\n".join([f"LUT_{axes}D_SIZE {len(table)}", *rows]).encode()


def test_curves_and_their_domain() -> None:
    read = parse_cube(CURVES)
    np.testing.assert_allclose(read.values, [[0, 0, 0], [0.5, 1, 0.1], [1, 1, 1]])
    assert (read.low, read.high) == ((0, 0, 0), (1, 2, 4))


def test_red_runs_fastest() -> None:
    table = cube(4)
    assert np.array_equal(parse_cube(written(table)).values, table)


def test_the_domain_as_resolve_writes_it() -> None:
    read = parse_cube(b"LUT_3D_SIZE 2\nLUT_3D_INPUT_RANGE -1 3\n" + b"0 0 0\n" * 8)
    assert (read.low, read.high) == ((-1, -1, -1), (3, 3, 3))


@pytest.mark.parametrize(
    ("file", "said"),
    [
        (b"TITLE \"a\"\n", "LUT_1D_SIZE or LUT_3D_SIZE is missing"),
        (b"LUT_3D_SIZE 66\n", "line 1: LUT_3D_SIZE must be a whole number from 2 to 65"),
        (b"LUT_1D_SIZE 1\n", "line 1: LUT_1D_SIZE"),
        (b"LUT_1D_SIZE 99999999999\n", "line 1: LUT_1D_SIZE"),
        (b"LUT_1D_SIZE 2\nLUT_3D_SIZE 2\n", "line 2: a second table"),
        (b"0 0 0\n", "line 1: LUT_1D_SIZE or LUT_3D_SIZE must come before"),
        (b"LUT_1D_SIZE 2\n0 0 0\n0 0\n", "line 3: must be three numbers"),
        (b"LUT_1D_SIZE 2\n0 0 0\n0 0 x\n", "line 3: must be three numbers"),
        (b"LUT_1D_SIZE 2\n0 0 0\n0 0 nan\n", "line 3: a number must be finite"),
        (b"LUT_1D_SIZE 2\n0 0 0\n0 0 1e9\n", "line 3: a number must be finite"),
        (b"LUT_1D_SIZE 2\n0 0 0\n", "ends after 1 of 2 lines"),
        (b"LUT_1D_SIZE 2\n" + b"0 0 0\n" * 3, "line 4: the table has 2 lines"),
        (b"LUT_1D_SIZE 2\n0 0 0\nTITLE \"a\"\nDOMAIN_MIN 0 0 0\n", "line 4: 'DOMAIN_MIN' comes after"),
        (b"LUT_1D_SIZE 2\nGAMMA 2\n", "line 2: 'GAMMA' is not a keyword"),
        (b"LUT_1D_SIZE 2\nDOMAIN_MIN 0 2 0\n" + b"0 0 0\n" * 2, "the domain ends"),
        (b"LUT_1D_SIZE 2\nLUT_1D_INPUT_RANGE 0\n", "line 2: LUT_1D_INPUT_RANGE takes two"),
    ],
)  # fmt: skip
def test_broken_files_name_the_line(file: bytes, said: str) -> None:
    with pytest.raises(ParseError, match=said):
        parse_cube(file)


def test_it_is_an_asset(tmp_path: Path) -> None:
    store = AssetStore(tmp_path)
    try:
        info = store.add(written(cube(3)))
        assert (info.kind, info.format) == ("lut", "cube") and store.info(info.id) == info
        assert np.array_equal(as_lut(store.load(info.id), info.id).values, cube(3))
        with pytest.raises(AssetError, match="line 2: must be three numbers"):
            store.add(b"LUT_1D_SIZE 2\n1 2\n", filename="a.cube")
        with pytest.raises(AssetError, match="table of colours"):
            store.image(info.id)
        image = store.add(png(np.zeros((2, 2, 3), np.uint8)))
        with pytest.raises(AssetError, match=r"an image; a table of colours \(\.cube\)"):
            as_lut(store.load(image.id), "it")
    finally:
        store.close()


def test_it_is_recognised() -> None:
    assert sniff(CURVES) == sniff(b"\xef\xbb\xbf# a\n" + written(cube(2))) == "cube"
    assert sniff(b"# v 1\n" * 20_000, None, "a.cube") == "cube"
