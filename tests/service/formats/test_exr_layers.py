"""Which of an EXR's layers is shown, what is told of it, and what is refused."""

from __future__ import annotations

import json
import struct
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest

from service.cli.program import main
from service.formats.read.exr_layers import choose
from service.problems import AssetError
from service.server.assets import AssetStore
from tests import asset_files as make
from tests.exr_files import written, written_parts
from tests.serving import Server

RNG = np.random.default_rng(5)
TEXELS = RNG.random((6, 10, 16)).astype(np.float32) + 0.1


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Iterator[AssetStore]:
    store = AssetStore(tmp_path_factory.mktemp("data"))
    yield store
    store.close()


def rgb(*layers: str, more: str = "") -> list[str]:
    return [f"{layer}.{channel}" for layer in layers for channel in "RGB" + more]


def added(store: AssetStore, data: bytes) -> tuple[np.ndarray, list[str], list[str] | None]:
    info = store.add(data)
    return store.image(info.id).pixels, [each["detail"] for each in info.warnings or ()], info.layers


def of_channels(names: Sequence[str]) -> bytes:
    return written(TEXELS[..., : len(names)], names)


@pytest.mark.parametrize(
    ("layers", "shown"),
    [
        (("ViewLayer.AO", "ViewLayer.Combined"), "ViewLayer.Combined"),
        (("AO", "beauty"), "beauty"),
        (("AO", "BEAUTY"), "BEAUTY"),
        (("albedo", "rgba"), "rgba"),
        (("AO", "RGBA"), "RGBA"),
        (("albedo", "rgb"), "rgb"),
        (("albedo", "main.Color"), "main.Color"),
        (("Color", "beauty"), "beauty"),
        (("A.AO.left", "A.Combined.left"), "A.Combined.left"),
        (("CryptoObject00", "diffuse"), "diffuse"),
        (("AO", "diffuse"), "AO"),
    ],
)
def test_the_layer_that_is_the_picture_is_shown_and_told(
    store: AssetStore, layers: tuple[str, ...], shown: str
) -> None:
    at = 3 * layers.index(shown)
    pixels, warnings, listed = added(store, of_channels(rgb(*layers)))
    assert np.array_equal(pixels, TEXELS[..., at : at + 3])
    assert warnings == [f"layer {shown} of {', '.join(layers)} is shown; choose another one by `layer`"]
    assert listed == list(layers)
    parts = [(name, TEXELS[..., 3 * k : 3 * k + 3], "RGB") for k, name in enumerate(layers)]
    pixels, warnings, listed = added(store, written_parts(parts))
    assert np.array_equal(pixels, TEXELS[..., at : at + 3]) and listed == list(layers)
    assert warnings == [f"layer {shown} of {', '.join(layers)} is shown; choose another one by `layer`"]
    parts = [(f"part{k}", TEXELS[..., 3 * k : 3 * k + 3], rgb(name)) for k, name in enumerate(layers)]
    assert np.array_equal(added(store, written_parts(parts))[0], TEXELS[..., at : at + 3])


def test_its_alpha_comes_with_a_layer(store: AssetStore) -> None:
    names = [*rgb("V.AO"), *rgb("V.Combined", more="A"), "V.Depth.Z"]
    pixels, _, listed = added(store, of_channels(names))
    assert np.array_equal(pixels, TEXELS[..., 3:7]) and listed == ["V.AO", "V.Combined", "V.Depth.Z"]


def test_plain_channels_come_first_and_nothing_is_told(store: AssetStore) -> None:
    pixels, warnings, listed = added(store, of_channels([*"RGB", *rgb("beauty")]))
    assert np.array_equal(pixels, TEXELS[..., :3]) and warnings == [] and listed == ["", "beauty"]
    assert added(store, of_channels([*"RGB"]))[2] is None


@pytest.mark.parametrize(
    ("names", "shown"),
    [
        ("Y", [0]),
        ("YA", [0, 0, 0, 1]),
        (["L.Y", "Z"], [0]),
        (["mask"], [0]),
        (["diffuse.Y", "diffuse.A"], [0, 0, 0, 1]),
    ],
)
def test_luminance_alone_is_grey(store: AssetStore, names: Sequence[str], shown: list[int]) -> None:
    pixels, warnings, _ = added(store, of_channels(list(names)))
    assert np.array_equal(pixels, TEXELS[..., shown]) and warnings == []


@pytest.mark.parametrize("names", [["Z"], ["depth"], ["depth.Z"], ["id"], ["objectId", "Z"], ["N.X", "N.Y", "N.Z"]])
def test_data_are_refused_with_their_names(store: AssetStore, names: list[str]) -> None:
    with pytest.raises(AssetError, match=r"it has no channels R, G and B; it has .*: data, not a picture") as refused:
        store.add(of_channels(names))
    assert all(name in refused.value.detail for name in names)


def subsampled(names: dict[str, int]) -> bytes:
    """An EXR whose header says so; the texels never come."""
    channels = b"".join(
        name.encode() + b"\0" + struct.pack("<IBBBBii", 1, 0, 0, 0, 0, n, n) for name, n in sorted(names.items())
    )
    whole = make.exr(TEXELS[..., :3])
    at = whole.index(b"channels\0chlist\0") + len(b"channels\0chlist\0")
    (size,) = struct.unpack_from("<I", whole, at)
    return whole[:at] + struct.pack("<I", len(channels) + 1) + channels + b"\0" + whole[at + 4 + size :]


@pytest.mark.parametrize(
    ("names", "said"),
    [
        ({"Y": 1, "RY": 2, "BY": 2}, r"its chroma is subsampled \(luminance/chroma\); save it as RGB"),
        ({"Y": 1, "RY": 2, "BY": 2, "A": 1}, r"its chroma is subsampled \(luminance/chroma\); save it as RGB"),
        ({"left.RY": 2, "left.BY": 2, "left.Y": 1}, "its chroma is subsampled"),
        ({"R": 1, "G": 1, "B": 4}, "its channel B is subsampled; save it with a value for every pixel"),
    ],
)
def test_subsampled_channels_are_refused_by_name(store: AssetStore, names: dict[str, int], said: str) -> None:
    with pytest.raises(AssetError, match=said):
        store.add(subsampled(names))


def test_luminance_and_chroma_of_every_pixel_are_a_picture(store: AssetStore) -> None:
    picture = TEXELS[..., :3]
    y = picture @ np.array([0.2126, 0.7152, 0.0722], np.float32)
    planes = np.stack([y, picture[..., 0] / y - 1, picture[..., 2] / y - 1], axis=2)
    pixels, warnings, _ = added(store, written(planes, ("Y", "RY", "BY")))
    assert np.allclose(pixels, picture, atol=1e-5) and warnings == []


def deep_spec(name: str, channels: str, is_deep: bool = True) -> oiio.ImageSpec:
    made = oiio.ImageSpec(2, 2, len(channels), "float")
    made.channelnames, made.deep = list(channels), is_deep
    made.attribute("oiio:subimagename", name)
    return made


@pytest.mark.parametrize("channels", ["RGBAZ", "AZ"])
def test_a_deep_image_is_refused_as_such(store: AssetStore, channels: str) -> None:
    points = oiio.DeepData()
    points.init(4, len(channels), ["float"] * len(channels), list(channels))
    with tempfile.NamedTemporaryFile(suffix=".exr") as made:
        output = oiio.ImageOutput.create(made.name)
        assert output.open(made.name, deep_spec("points", channels)) and output.write_deep_image(points)
        output.close()
        data = Path(made.name).read_bytes()
    with pytest.raises(AssetError, match="deep images are not supported"):
        store.add(data)


def test_deep_parts_are_no_layers() -> None:
    class File:
        """Parts as OpenImageIO shows them, which writes none of both kinds together."""

        parts = (deep_spec("points", "RGBAZ"), deep_spec("flat", "RGB", is_deep=False))
        part = 0

        def seek_subimage(self, part: int, level: int) -> bool:
            self.part = part
            return part < len(self.parts)

        def spec(self) -> oiio.ImageSpec:
            return self.parts[self.part]

    choice = choose(File())
    assert (choice.layer.part, choice.layer.channels, choice.warnings, choice.names) == (1, (0, 1, 2), (), ())


def test_an_upload_is_answered_with_the_layers(server: Server) -> None:
    answer = server.http.post("/v1/assets", content=of_channels(rgb("V.AO", "V.Combined")))
    assert answer.status_code == 201
    info = answer.json()
    assert info["layers"] == ["V.AO", "V.Combined"]
    assert info["warnings"][0]["detail"].startswith("layer V.Combined of V.AO, V.Combined is shown")
    document = {
        "version": 1,
        "camera": {"position": [0, 0, 4], "target": [0, 0, 0]},
        "materials": {},
        "shapes": [],
        "environment": {"type": "image", "asset": info["id"], "layer": "V.Normal"},
    }
    refused = server.http.post("/v1/renders", json={"scene": document})
    assert refused.status_code == 422
    (error,) = refused.json()["errors"]
    assert error["pointer"] == "/scene/environment/layer" and "it has V.AO, V.Combined" in error["detail"]


def test_the_command_names_the_layers_of_a_file_beside_the_scene(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("SUNBOX_DATA_DIR", str(tmp_path / "data"))
    (tmp_path / "sky.exr").write_bytes(of_channels(rgb("V.AO", "V.Combined")))
    document = {
        "version": 1,
        "camera": {"position": [0, 0, 4], "target": [0, 0, 0]},
        "materials": {},
        "shapes": [],
        "environment": {"type": "image", "asset": "sky.exr", "layer": "V.Normal"},
    }
    (tmp_path / "scene.json").write_text(json.dumps(document))
    assert main(["render", str(tmp_path / "scene.json"), "-o", str(tmp_path / "a.png")]) == 2
    assert "/environment/layer: 'sky.exr': it has no layer 'V.Normal'; it has V.AO" in capsys.readouterr().err
