"""What of the image can be checked without building it: pins, packages, variables, files."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import httpx
import pytest

from service.cli import health
from service.config import Config
from service.server import app
from tests.serving import Server

ROOT = Path(__file__).parents[1]
DOCKERFILE, COMPOSE = (ROOT / "Dockerfile").read_text(), (ROOT / "compose.yaml").read_text()
WORKFLOW = (ROOT / ".github" / "workflows" / "check.yml").read_text()
LOCKS = ("requirements.lock", "requirements.serve.lock", "requirements.build.lock")
NOT_SHIPPED = ("requirements.notebook.lock",)
PIN = re.compile(r"^([a-z0-9_.-]+)==[^\\]+\\\n(?:    --hash=\S+(?: \\)?\n)+", re.MULTILINE | re.IGNORECASE)


def pins(name: str) -> dict[str, str]:
    """Versions and hashes, without the machines that they are for: what tests alone need may want them on more."""
    text = re.sub(r" ; [^\\\n]+(?= \\)", "", (ROOT / name).read_text())
    return {match[1].lower(): match[0] for match in PIN.finditer(text + "\n")}


def test_the_image_has_what_was_tested() -> None:
    """requirements.serve.lock is requirements.lock without the extras: uv pip compile, with that as constraint.

    requirements.build.lock is hatchling, and what that needs.
    """
    everything, serving, building = map(pins, LOCKS)
    assert "hatchling" in building and {name: everything.get(name) for name in building} == building
    assert len(serving) > 20 and {name: everything.get(name) for name in serving} == serving
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    wanted = {re.split(r"[<>=\[; ]", text)[0].lower() for text in project["dependencies"]}
    client = tomllib.loads((ROOT / "client/pyproject.toml").read_text())["project"]
    wanted |= {re.split(r"[<>=\[; ]", text)[0].lower() for text in client["dependencies"]}
    assert wanted - {"sunbox"} <= serving.keys() and "pytest" not in serving
    assert "materialx" in serving, "docs/files.md lists the format among what is read"


def test_images_and_actions_are_pinned_by_their_content() -> None:
    """A tag is whatever its owner makes it. What stands beside a pin says which version that is."""
    images = re.findall(r"^FROM (\S+)", DOCKERFILE, re.MULTILINE) + re.findall(r"image: (\S+[:/]\S+)", COMPOSE)
    assert len(images) == 3 and all(re.search(r":[^@]+@sha256:[0-9a-f]{64}$", image) for image in images), images
    actions = re.findall(r"uses: (.*)", WORKFLOW)
    assert actions and all(re.fullmatch(r"[\w/-]+@[0-9a-f]{40} # v[\d.]+", action) for action in actions), actions


def test_changes_are_tested_built_and_audited() -> None:
    for command in (".ci/run", "docker build -t sunbox .", "for lock in requirements*.lock", "pip-audit=="):
        assert command in WORKFLOW
    for ecosystem in ("pip", "docker", "docker-compose", "github-actions"):
        assert f"package-ecosystem: {ecosystem}" in (ROOT / ".github" / "dependabot.yml").read_text()


def test_the_image_has_the_packages_that_make_run_asks_for() -> None:
    (packages,) = re.findall(r'^MESA="(.*)"', (ROOT / ".ci/packages").read_text(), re.MULTILINE)
    for package in packages.split():
        assert f" {package}" in DOCKERFILE


@pytest.mark.parametrize("name", ["Dockerfile", "compose.yaml", ".dockerignore"])
def test_names_are_real(name: str) -> None:
    text = (ROOT / name).read_text()
    known = {f"SUNBOX_{field.upper()}" for field in Config.model_fields}
    assert set(re.findall(r"SUNBOX_[A-Z_]+", text)) <= known
    for source in re.findall(r"^COPY (?!--from)(.+) \S+$", text, re.MULTILINE):
        for file in source.split():
            assert (found := list(ROOT.glob(file)))
            ignored = (ROOT / ".dockerignore").read_text()
            assert all(f"\n!{each.name}\n" in ignored for each in found if each.name not in NOT_SHIPPED)


def test_the_image_runs_as_nobody_in_particular_and_writes_to_one_place() -> None:
    assert re.search(r"^USER \d+$", DOCKERFILE, re.MULTILINE) and "HEALTHCHECK" in DOCKERFILE
    assert re.findall(r"^VOLUME (.*)$", DOCKERFILE, re.MULTILINE) == ["/data"]
    for variable in ("SUNBOX_DATA_DIR", "XDG_CACHE_HOME", "HOME"):
        assert re.search(rf"{variable}=/data\b", DOCKERFILE)


def test_the_proxy_needs_a_key_and_keeps_the_metrics_to_itself() -> None:
    assert "SUNBOX_API_KEY: ${SUNBOX_API_KEY:?" in COMPOSE and "respond /metrics 404" in COMPOSE


def test_the_proxy_logs_no_secrets() -> None:
    """Its error log has each failed request: the stream's address holds a session's id, a subprotocol the key."""
    hidden = COMPOSE[COMPOSE.index("format filter") : COMPOSE.index("${SITE:-localhost}")]
    for line in ("request>uri query {", "replace session ", "replace beside ", "Sec-Websocket-Protocol delete"):
        assert line in hidden


def test_the_proxy_gives_idle_connections_up_first() -> None:
    """Else a request is sent on one that the server just closes, and is answered 502."""
    (minutes,) = re.findall(r"keepalive (\d+)m$", COMPOSE, re.MULTILINE)
    assert 60 * int(minutes) < app.KEEP_ALIVE_S


def test_the_health_check_asks_where_the_server_was_told_to_listen(
    server: Server, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    started = ["serve", "--host", "127.0.0.1", "--port", "0"]
    monkeypatch.setattr(health, "_commands", lambda: iter([started]))
    assert health.main() == 1 and "no answer" in capsys.readouterr().err
    started[-1] = str(httpx.URL(server.url).port)
    assert health.main() == 0
    monkeypatch.setattr(health, "_commands", lambda: iter([]))
    monkeypatch.setenv("SUNBOX_HOST", "0.0.0.0")
    monkeypatch.setenv("SUNBOX_PORT", started[-1])
    assert health.main() == 0


def test_the_health_check_finds_the_server(server: Server) -> None:
    assert ["serve", "--port", "0"] in list(health._commands())
