"""The editor's modules go out without their comments, and say the same."""

from __future__ import annotations

from pathlib import Path

import pytest

from service.server.app import WEB
from tests.serving import Server

MODULES = sorted(WEB.rglob("*.js"))


def uncommented(text: str) -> list[str]:
    return ["" if line.lstrip(" \t").startswith("//") else line for line in text.split("\n")]


def test_a_module_has_its_lines_and_no_comments(server: Server) -> None:
    for path in ("main.js", "picture/program.js", "lib/dom.js"):
        sent = server.http.get(f"/{path}")
        assert sent.headers["content-type"].startswith("text/javascript")
        assert sent.text.split("\n") == uncommented((WEB / path).read_text())
        assert "\n//" not in sent.text
        assert server.http.head(f"/{path}").headers["etag"] == sent.headers["etag"]


def test_a_style_sheet_too(server: Server) -> None:
    styles = server.http.get("/stage.css")
    assert styles.headers["content-type"].startswith("text/css")
    source = (WEB / "stage.css").read_text()
    assert "\n/*" in source and "\n/*" not in styles.text and styles.text.count("\n") == source.count("\n")
    assert [line for line in styles.text.split("\n") if line] == [
        line for line in source.split("\n") if line and not line.startswith("/*")
    ]


def test_a_part_of_a_file_is_the_files_own(server: Server) -> None:
    part = server.http.get("/main.js", headers={"range": "bytes=0-9"})
    assert part.status_code == 206 and part.content == (WEB / "main.js").read_bytes()[:10]


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(WEB)))
def test_no_line_of_a_template_looks_like_a_comment(path: Path) -> None:
    """Else it would be missing from the text."""
    is_text = False
    for line in path.read_text().split("\n"):
        is_comment = line.lstrip(" \t").startswith("//")
        assert not (is_text and is_comment), line
        if not is_comment and line.replace("\\`", "").count("`") % 2:
            is_text = not is_text
    assert not is_text
