"""Who may import whom: the arrows of the house point down, and nobody talks past their room."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
MODULES = sorted((*ROOT.glob("gpu/**/*.py"), *ROOT.glob("service/**/*.py")))
SHADERS = sorted(path for path in ROOT.glob("shaders/**/*") if path.suffix in {".glsl", ".comp"})

# From the bottom to the top: a module imports from its own line and from lines above its own in this list.
LAYERS = [
    {"service.problems", "service.shared_memory", "service.cpu_time", "service.confined"},
    {"service.config"},
    {"service.scene", "service.images"},
    {"service.quality", "service.presets", "service.assets"},
    {"service.recipe"},
    {"service.quota"},
    {"service.documents"},
    {"service.storage"},
    {"service.pack"},
    {"service.logs", "service.log_output"},
    {"service.downloads"},
    {"service.rendering"},
    {"service.readiness"},
    {"service.traffic", "service.bodies"},
    {"service.state"},
    {"service.keys"},
    {"service.connection_limits", "service.connections", "service.guard", "service.metrics", "service.routes"},
    {"service.app"},
    {"service.bench"},
    {"service.commands"},
    {"service.cli"},
]
NAMES_GPU = ("service.pack", "service.cli", "service.commands", "service.rendering.worker", "service.bench")
ERRORS = ("gpu.errors", "service.problems")
WEB_FRAMEWORK = {"fastapi", "starlette", "uvicorn", "websockets", "pydantic", "pydantic_settings"}


def name_of(path: Path) -> str:
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def imports_of(path: Path) -> Iterator[str]:
    """Every module named by an import statement, also inside functions and under TYPE_CHECKING."""
    package = list(path.relative_to(ROOT).parent.parts)
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1] if node.level else []
            module = ".".join([*base, *(node.module or "").split(".")]).strip(".")
            # `from service import images` names service.images; `from gpu.errors import GpuError` gpu.errors.GpuError
            yield from (f"{module}.{alias.name}" for alias in node.names)


def within(module: str, *packages: str) -> bool:
    return any(module == package or module.startswith(package + ".") for package in packages)


def layer(module: str) -> int:
    return next((i for i, packages in enumerate(LAYERS) if within(module, *packages)), -1)


@pytest.mark.parametrize("path", MODULES, ids=name_of)
def test_module_keeps_to_its_room(path: Path) -> None:
    module = name_of(path)
    for imported in imports_of(path):
        top = imported.split(".")[0]
        said = f"{module} imports {imported}"
        if within(module, "gpu"):
            assert top != "service" and top not in WEB_FRAMEWORK, said
        else:
            assert top != "moderngl", said
            assert top != "gpu" or within(module, *NAMES_GPU), said
        if module in ERRORS:
            assert top not in {"gpu", "service"}, said
        if top == "service" and module != "service":
            assert layer(imported) <= layer(module), f"{said}: that arrow points up"


def test_every_service_module_has_its_place() -> None:
    assert [name_of(path) for path in MODULES if layer(name_of(path)) < 0 and path.match("service/*")] in (
        [],
        ["service"],
    )


def test_shaders_are_text() -> None:
    assert not list(ROOT.glob("shaders/**/*.py")) and not list(ROOT.glob("web/**/*.py"))


@pytest.mark.parametrize("path", SHADERS, ids=lambda path: str(path.relative_to(ROOT)))
def test_lobe_light_or_shape_includes_no_sibling(path: Path) -> None:
    folder = path.parent.name
    if folder == "shaders":
        return
    for included in re.findall(r'^\s*#\s*include\s+"([^"]+)"', path.read_text(), re.MULTILINE):
        assert not included.startswith(f"{folder}/") and (path.parent / included).exists() is False, (
            f"{path.relative_to(ROOT)} includes its sibling {included}"
        )
