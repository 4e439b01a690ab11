"""Settings, quality presets and the configuration."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path
from typing import Any, get_args

import pytest

from service.config import ConfigError, load_config, unknown_variables
from service.document import Settings, parse_settings
from service.document.quality import PRESETS, ResolvedSettings, resolve
from service.problems import InvalidDocument

NAN, INF = float("nan"), float("inf")


def resolved(**settings: Any) -> ResolvedSettings:
    return resolve(parse_settings(settings))


def test_defaults_are_balanced() -> None:
    assert resolved().document() == {
        "width": 512,
        "height": 512,
        "max_samples": 256,
        "max_bounces": 8,
        "time_limit": None,
        "target_noise": None,
        "seed": 0,
        "quality": "balanced",
        "estimator": "mis",
        "sampler": "sobol",
        "filter": "blackman_harris",
        "roulette_depth": 3,
        "resolution_scale": 1.0,
        "adaptive": False,
        "clamp": None,
        "caustics": None,
        "filter_glossy": 0.0,
        "denoise": False,
    }


def test_presets_are_those_of_the_schema_and_rise() -> None:
    assert tuple(PRESETS) == get_args(Settings.model_fields["quality"].annotation)
    samples = [resolved(quality=name).max_samples for name in PRESETS]
    bounces = [resolved(quality=name).max_bounces for name in PRESETS]
    assert None not in samples and samples == sorted(set(samples)) and bounces == sorted(set(bounces))  # type: ignore[type-var]


@pytest.mark.parametrize("quality", PRESETS)
def test_a_preset_replaces_what_is_not_given_and_nothing_else(quality: str) -> None:
    given = {"max_samples": 7, "max_bounces": 1, "roulette_depth": 9, "resolution_scale": 0.5}
    assert given.items() <= resolved(quality=quality, **given).document().items()
    plain = resolved(quality=quality).document()
    for kept in ("clamp", "time_limit", "target_noise"):
        assert plain[kept] is None
        assert resolved(**{"quality": quality, kept: 0.5}).document()[kept] == 0.5
    assert plain["adaptive"] is plain["denoise"] is False


@pytest.mark.parametrize("limit", ["time_limit", "target_noise"])
def test_another_limit_lifts_that_on_samples(limit: str) -> None:
    assert resolved(**{limit: 2.0}).max_samples is None
    assert resolved(**{limit: 2.0, "max_samples": 5}).max_samples == 5


@pytest.mark.parametrize(("scale", "size"), [(1, (101, 51)), (0.5, (50, 26)), (0.001, (1, 1))])
def test_resolution_scale_gives_the_rendered_size(scale: float, size: tuple[int, int]) -> None:
    settings = resolved(width=101, height=51, resolution_scale=scale)
    assert (settings.render_width, settings.render_height) == size
    assert (settings.for_gpu()["width"], settings.for_gpu()["height"]) == size


def test_the_renderer_knows_every_keyword() -> None:
    from gpu.settings import RenderSettings

    assert set(resolved().for_gpu()) == {field.name for field in fields(RenderSettings)}
    assert RenderSettings(**resolved(seed=3, clamp=2.0).for_gpu()).clamp == 2.0


@pytest.mark.parametrize(
    ("name", "value"),
    [
        *[("width", v) for v in (0, -1, 10.5, 512.0, True, "512", None, NAN)],
        *[("height", v) for v in (0, 10.5, [1], INF)],
        *[("max_samples", v) for v in (0, -4, 2**24 + 1, 1.5, None)],
        *[("max_bounces", v) for v in (-1, 1025)],
        *[("roulette_depth", v) for v in (-1, 1025)],
        *[("seed", v) for v in (-1, 2**32)],
        *[("resolution_scale", v) for v in (0, 1.01, NAN)],
        *[(name, v) for name in ("time_limit", "target_noise", "clamp") for v in (0, -1, NAN, INF, True, "1")],
        *[("quality", v) for v in ("best", 1, None)],
        *[("estimator", v) for v in ("bdpt", "MIS", ["mis"])],
        ("sampler", "halton"),
        ("filter", "sinc"),
        *[("adaptive", v) for v in (0, 1, "false", None)],
        *[("denoise", v) for v in (0, 1, "false", None)],
        ("samples", 9),
    ],
)
def test_refused_with_the_field_s_pointer(name: str, value: Any) -> None:
    with pytest.raises(InvalidDocument) as caught:
        parse_settings({name: value}, "/settings")
    assert [error.pointer for error in caught.value.errors] == [f"/settings/{name}"]


@pytest.mark.parametrize(
    ("name", "value"),
    [("max_samples", 2**24), ("max_bounces", 0), ("max_bounces", 1024), ("seed", 2**32 - 1), ("clamp", 1e20),
     ("resolution_scale", 1e-3), ("time_limit", 1), ("adaptive", False), ("adaptive", True), ("denoise", False),
     ("denoise", True)],
)  # fmt: skip
def test_ends_of_ranges_are_taken(name: str, value: Any) -> None:
    assert getattr(parse_settings({name: value}), name) == value


def test_pixels_are_limited_together() -> None:
    parse_settings({"width": 4096, "height": 4096})
    with pytest.raises(InvalidDocument) as caught:
        parse_settings({"width": 4096, "height": 4097}, "/settings")
    assert caught.value.errors[0].pointer == "/settings/height"
    with pytest.raises(InvalidDocument, match="SUNBOX_MAX_PIXELS"):
        parse_settings({"width": 101, "height": 1}, limits=load_config(max_pixels=100))


def test_the_document_must_be_an_object() -> None:
    for document in ([], None, 5, "x"):
        with pytest.raises(InvalidDocument) as caught:
            parse_settings(document, "/settings")
        assert caught.value.errors[0].pointer == "/settings"


def test_configuration_comes_from_the_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SUNBOX_MAX_PIXELS", "1000")
    monkeypatch.setenv("SUNBOX_ALLOWED_ORIGINS", "https://a.example, https://b.example")
    monkeypatch.setenv("SUNBOX_DEVICE", "")
    monkeypatch.setenv("XDG_CACHE_HOME", "/somewhere")
    monkeypatch.delenv("SUNBOX_DATA_DIR", raising=False)
    config = load_config(port=None, host="::1")
    assert (config.max_pixels, config.port, config.host, config.device) == (1000, 8000, "::1", None)
    assert config.allowed_origins == ["https://a.example", "https://b.example"]
    assert config.data_dir == Path("/somewhere/sunbox")


def test_a_bad_variable_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SUNBOX_MAX_TRIANGLES", "99999999")
    monkeypatch.setenv("SUNBOX_PORT", "http")
    with pytest.raises(ConfigError, match=r"SUNBOX_PORT.*SUNBOX_MAX_TRIANGLES"):
        load_config()


@pytest.mark.parametrize("value", ["", "  "])
def test_an_empty_key_does_not_open_the_service(value: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """It is what a compose file passes on for `${SUNBOX_API_KEY:-}` when its author forgot to set one."""
    monkeypatch.setenv("SUNBOX_API_KEY", value)
    with pytest.raises(ConfigError, match=r"^SUNBOX_API_KEY: is set, but empty; .* remove it"):
        load_config()
    monkeypatch.delenv("SUNBOX_API_KEY")
    assert load_config().api_key == []


def test_hosts_are_names(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SUNBOX_ALLOWED_HOSTS", "Render.example, 10.0.0.7,[fd00::1],")
    assert load_config().allowed_hosts == ["render.example", "10.0.0.7", "fd00::1"]
    for wrong in ("https://render.example", "render.example:8000", "a b", "render.example/sunbox"):
        monkeypatch.setenv("SUNBOX_ALLOWED_HOSTS", wrong)
        with pytest.raises(ConfigError, match=r"^SUNBOX_ALLOWED_HOSTS: '.*' is no host name"):
            load_config()


@pytest.mark.parametrize("name", ["BODY_TIMEOUT", "MAX_SECONDS", "KEEP_SECONDS", "HANG_S"])
def test_times_are_finite(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """GET /v1/info tells them, in JSON."""
    for value in ("inf", "nan", "0", "-1"):
        monkeypatch.setenv(f"SUNBOX_{name}", value)
        with pytest.raises(ConfigError, match=f"^SUNBOX_{name}: "):
            load_config()


def test_misspelt_variables_are_found(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SUNBOX_APIKEY", "secret")
    monkeypatch.setenv("SUNBOX_PORT", "1")
    assert "SUNBOX_APIKEY" in unknown_variables() and "SUNBOX_PORT" not in unknown_variables()
