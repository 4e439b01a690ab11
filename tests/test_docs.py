"""The pages that people read: links lead somewhere, all that is shipped is in the notices, modules are preloaded."""

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
NOT_SHIPPED = ("requirements.build.lock", "requirements.notebook.lock")
STATIC = re.compile(r"""^(?:import|export)\b[^;"]*?"(\.{1,2}/[^"]+)";""", re.M)  # an import of a module
LINK = re.compile(r"\]\(([^)#\s]+)|src=\"([^\"]+)\"")


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_links_lead_to_files(page: Path) -> None:
    links = [first or second for first, second in LINK.findall(page.read_text())]
    missing = [link for link in links if "://" not in link and not (page.parent / link).exists()]
    assert not missing


def test_every_shipped_package_is_in_the_notices() -> None:
    notices = (ROOT / "docs" / "notices.md").read_text()
    listed = {_normal(name) for name in re.findall(r"^\| ([\w.-]+) \| \w", notices, re.MULTILINE)}
    for lock in (path.name for path in ROOT.glob("requirements.*.lock") if path.name not in NOT_SHIPPED):
        locked = re.findall(r"^([a-z0-9][\w.-]*)==", (ROOT / lock).read_text(), re.MULTILINE)
        assert locked and {_normal(name) for name in locked} <= listed


def test_nobody_is_told_to_install_a_name_that_no_index_has() -> None:
    """Whoever registers it there runs programs on users' machines: pages and hints name a checkout or a wheel."""
    files = [path for folder in ("docs", "service", "client", "web", "gpu") for path in (ROOT / folder).rglob("*.*")]
    texts = [path for path in [ROOT / "README.md", *files] if path.suffix in (".md", ".py", ".js", ".html", ".ipynb")]
    name = re.compile(r"pip3? install[^\n`]*?[ '\"](sunbox(-server)?(\[[\w,]+\])?)(?![\w./-])")
    told = {f"{path.relative_to(ROOT)}: {found[0]}" for path in texts for found in name.finditer(path.read_text())}
    assert told == {"docs/scaling.md: pip install sunbox"}, "which says what it would install"


def _normal(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name).lower()


def test_the_page_preloads_the_modules_that_it_begins_with() -> None:
    """Else a browser asks for the imports of a module when it has that: one depth after the other."""
    web = ROOT / "web"
    needed: set[str] = set()
    found = {"main.js"}
    while found:
        needed |= found
        reached = ((web / path).parent / each for path in found for each in STATIC.findall((web / path).read_text()))
        found = {str(path.resolve().relative_to(web)) for path in reached} - needed
    listed = re.findall(r'<link rel="modulepreload" href="([^"]+)">', (web / "index.html").read_text())
    expected = sorted(needed - {"main.js"})
    lines = "\n".join(f'  <link rel="modulepreload" href="{path}">' for path in expected)
    assert listed == expected, f"the list in web/index.html has to be:\n{lines}"
