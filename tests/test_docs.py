"""The pages that people read: their links lead somewhere, and everything that is shipped is named in the notices."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PAGES = [
    ROOT / "README.md",
    ROOT / "CHANGELOG.md",
    ROOT / ".github" / "SECURITY.md",
    ROOT / "shaders" / "README.md",
    *(ROOT / "docs").glob("*.md"),
]
LINK = re.compile(r"\]\(([^)#\s]+)|src=\"([^\"]+)\"")


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_links_lead_to_files(page: Path) -> None:
    links = [first or second for first, second in LINK.findall(page.read_text())]
    missing = [link for link in links if "://" not in link and not (page.parent / link).exists()]
    assert not missing


def test_every_shipped_package_is_in_the_notices() -> None:
    notices = (ROOT / "docs" / "notices.md").read_text()
    listed = {_normal(name) for name in re.findall(r"^\| ([\w.-]+) \| \w", notices, re.MULTILINE)}
    for lock in ("requirements.serve.lock", "requirements.ray.lock"):
        locked = re.findall(r"^([a-z0-9][\w.-]*)==", (ROOT / lock).read_text(), re.MULTILINE)
        assert locked and {_normal(name) for name in locked} <= listed


def _normal(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name).lower()
