"""What set-up does about Debian's packages, with an apt-get, id and sudo that only write down what they are asked."""

from __future__ import annotations

import os
import subprocess
from dataclasses import dataclass
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
OLD = "llvmpipe (LLVM 15.0.6, 256 bits) 4.5 (Core Profile) Mesa 22.3.6"
NEW = "llvmpipe (LLVM 15.0.6, 256 bits) 4.5 (Core Profile) Mesa 25.0.7"
APT = """#!/bin/sh
if [ "$1" = indextargets ]; then
    printf '%s\\n' 'contrib bookworm http://other/' 'main bookworm http://mirror/debian/' 'main bookworm-updates http://no/'
    exit
fi
echo "$@" >>"$ASKED"
for word; do case $word in Dir::Etc::SourceList=*) cat "${word#*=}" >"$SOURCES" ;; esac; done
exit "$STATUS"
"""


@dataclass
class Machine:
    folder: Path
    user: int = 0
    status: int = 0  # that apt-get ends with

    def does(self, command: str) -> subprocess.CompletedProcess[str]:
        """Runs it with the functions of .ci/packages, on a Debian 12 without a GPU."""
        programs = {"apt-get": APT, "id": f"#!/bin/sh\necho {self.user}\n", "sudo": "#!/bin/sh\nexit 1\n"}
        for name, text in programs.items():
            (self.folder / name).write_text(text)
            (self.folder / name).chmod(0o755)
        (self.folder / "temporary").mkdir(exist_ok=True)
        script = (
            "set -euo pipefail; . .ci/packages; is_debian_12() { true; }; has_gpu() { false; }; "
            f"lavapipe_is_here() {{ false; }}; {command}"
        )
        paths = {name: str(self.folder / name.lower()) for name in ("ASKED", "SOURCES")}
        environment = {
            **os.environ,
            **paths,
            "PATH": f"{self.folder}:{os.environ['PATH']}",
            "STATUS": str(self.status),
            "TMPDIR": str(self.folder / "temporary"),
        }
        return subprocess.run(["bash", "-c", script], cwd=ROOT, env=environment, capture_output=True, text=True)

    @property
    def asked(self) -> list[str]:
        return (self.folder / "asked").read_text().splitlines() if (self.folder / "asked").exists() else []


def test_who_may_not_install_is_told_the_packages(tmp_path: Path) -> None:
    machine = Machine(tmp_path, user=1000)
    done = machine.does("install_packages chromium procps || echo and goes on")
    assert done.stdout == "and goes on\n" and done.returncode == 0
    assert "apt-get install --no-install-recommends chromium procps" in done.stderr and not machine.asked


def test_a_faster_mesa_comes_from_backports_and_leaves_no_trace(tmp_path: Path) -> None:
    machine = Machine(tmp_path)
    done = machine.does(f"offer_faster_mesa '{OLD}'")
    assert done.returncode == 0, done.stderr
    update, install = machine.asked
    assert update.endswith(" update") and " -t bookworm-backports libegl1 " in install and "--no-remove" in install
    assert "libglx-mesa0" in install  # not to be mixed with another version's
    for words in (update, install):
        assert "Dir::Etc::SourceParts=/dev/null" in words
        for place in ("Dir::Etc::SourceList", "Dir::State::Lists", "Dir::Cache"):
            assert f"{place}={tmp_path}/temporary/" in words
    sources = (tmp_path / "sources").read_text().splitlines()
    suites = ["bookworm", "bookworm-updates", "bookworm-backports"]
    assert [line.split("] ")[1] for line in sources] == [f"http://mirror/debian/ {suite} main" for suite in suites]
    assert not list((tmp_path / "temporary").iterdir())


def test_offline_it_goes_on_with_the_mesa_that_is_there(tmp_path: Path) -> None:
    machine = Machine(tmp_path, status=100)
    done = machine.does(f"offer_faster_mesa '{OLD}'")
    assert done.returncode == 0 and "that failed" in done.stderr and len(machine.asked) == 1
    assert not list((tmp_path / "temporary").iterdir())


@pytest.mark.parametrize(("user", "more"), [(1000, ""), (0, "has_gpu() { true; };")])
def test_where_it_is_the_owners_affair_it_is_only_told(tmp_path: Path, user: int, more: str) -> None:
    machine = Machine(tmp_path, user)
    done = machine.does(f"{more} offer_faster_mesa '{OLD}'")
    assert done.returncode == 0 and "apt-get install -t bookworm-backports" in done.stderr and not machine.asked


@pytest.mark.parametrize(
    "renderer", ["llvmpipe (LLVM 19) 4.5 Mesa 25.0.7", "NVIDIA L4 4.6", "Intel HD 4.6 Mesa 22.3.6"]
)
def test_other_drivers_are_let_be(tmp_path: Path, renderer: str) -> None:
    machine = Machine(tmp_path)
    done = machine.does(f"offer_faster_mesa '{renderer}'")
    assert done.returncode == 0 and not done.stderr and not machine.asked


def test_lavapipe_comes_from_where_mesa_does(tmp_path: Path) -> None:
    machine = Machine(tmp_path)
    done = machine.does(f"offer_lavapipe '{NEW}'")
    assert done.returncode == 0, done.stderr
    update, install = machine.asked
    assert update.endswith(" update") and install.endswith(" --no-remove -t bookworm-backports mesa-vulkan-drivers")
    assert "Dir::Etc::SourceParts=/dev/null" in install and not list((tmp_path / "temporary").iterdir())


@pytest.mark.parametrize(("user", "status"), [(1000, 0), (0, 100)])
def test_without_lavapipe_it_goes_on(tmp_path: Path, user: int, status: int) -> None:
    done = Machine(tmp_path, user, status).does(f"offer_lavapipe '{NEW}'")
    assert done.returncode == 0 and "the test that needs it is skipped" in done.stderr


@pytest.mark.parametrize("status", [0, 100])
def test_a_headless_shell_is_offered_beside_a_whole_browser(tmp_path: Path, status: int) -> None:
    machine = Machine(tmp_path, status=status)
    done = machine.does("headless_shell_is_here() { false; }; offer_headless_shell")
    assert done.returncode == 0 and machine.asked[0].endswith(" update")
    assert ("run in chromium instead" in done.stderr) == bool(status)
    if not status:
        assert machine.asked[1].endswith(" install chromium-headless-shell")
    (tmp_path / "asked").unlink()
    machine.does("headless_shell_is_here() { true; }; offer_headless_shell")
    assert not machine.asked


@pytest.mark.parametrize(
    ("renderer", "more"), [("NVIDIA L4 4.6", ""), (OLD, ""), (NEW, "lavapipe_is_here() { true; };")]
)
def test_lavapipe_is_only_for_a_machine_that_lacks_it(tmp_path: Path, renderer: str, more: str) -> None:
    machine = Machine(tmp_path)
    done = machine.does(f"{more} offer_lavapipe '{renderer}'")
    assert done.returncode == 0 and not done.stderr and not machine.asked
