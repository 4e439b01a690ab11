"""Who may import whom: the arrows of the house point down, and nobody talks past their room."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable, Iterator, Mapping
from functools import cache
from pathlib import Path

import pytest

from gpu.layout.models import NUMBERS
from tests.conftest import LONG_FILES, TESTS

ROOT = Path(__file__).parents[1]
MODULES = sorted((*ROOT.glob("gpu/**/*.py"), *ROOT.glob("service/**/*.py")))
FOLDERS = sorted({path.parent for path in (*MODULES, *ROOT.glob("tests/bench/**/*.py"))})
SHADERS = sorted(path for path in ROOT.glob("shaders/**/*") if path.suffix in {".glsl", ".comp"})
# Shader files of which each is one kind of a thing; the named ones put the kinds of their folder together.
COMPOSERS = {"lights", "light_tree", "shapes", "traverse", "transparency", "transparency_walk", "budget"}
KINDS = ("bsdf/lobes/**", "bsdf/models", "lights", "shapes", "tonemap")
LEAVES = sorted(p for kind in KINDS for p in ROOT.glob(f"shaders/{kind}/*.glsl") if p.stem not in COMPOSERS)
CLIENT = sorted(path for path in ROOT.glob("client/**/*.py") if path.name != "document.py")  # that is generated
PACKAGE = [path for path in CLIENT if path.is_relative_to(ROOT / "client" / "src") and path.stem != "__init__"]
SOURCES = sorted((*MODULES, *CLIENT, *SHADERS, *ROOT.glob("tests/**/*.py"), *ROOT.glob("web/**/*.js")))
MOST_LINES = 400
# Files that are longer, each with the reason why it is one all the same.
LONG = {"service/server/renders/render.py": "what becomes of one render is read through"}
MOST_METHODS, MOST_ATTRIBUTES = 30, 18  # of a class, its bases included
# Classes whose fields are a format, a document or a row, and not state that methods share.
DATA = {"BaseModel", "Model", "Record", "IntEnum", "Enum", "Protocol"}
# Classes that are larger, each with the reason why it is one all the same.
LARGE_CLASSES = {
    "service.renderers.local.supervisor.Supervisor": "one renderer: its tasks are its state",
    "service.server.renders.render.Render": "one render: parts of it would only forward to each other",
    "gpu.arrays.SceneArrays": "one field for each array of a scene",
}

# From the bottom to the top: a module imports from its own line and from lines above its own in this list.
LAYERS = [
    {
        "service.problems", "service.callback_hosts", "service.containers", "service.quantities", "service.config",
        "service.views", "service.displays", "service.colorimetry",
    },
    {"service.system"},
    {"service.ipc"},
    {"service.document"},
    {"service.formats"},
    {"service.pack"},
    {"service.exports", "service.renderers", "service.worker"},
    {"service.server"},
    {"service.bench"},
    {"service.cli"},
]  # fmt: skip
GPU_LAYERS = [
    {"gpu.layout", "gpu.egl", "gpu.errors", "gpu.settings", "gpu.steps", "gpu.jit", "gpu.oidn", "gpu.denoise"},
    {"gpu.tables", "gpu.accel"},
    {"gpu.arrays", "gpu.context", "gpu.footprint"},
    {"gpu.kernels"},
    {"gpu.device"},
    {"gpu.picture", "gpu.bsdf"},
    {"gpu.precompile"},
    {"gpu.renderer"},
    {"gpu.analysis"},
]
# Which rooms of `gpu` others may look into; `gpu` stands for the names that gpu/__init__.py lists.
RUNS_KERNELS = ("gpu", "gpu.errors", "gpu.denoise", "gpu.precompile", "gpu.analysis")
LOOKS_INTO_GPU = {
    "service.pack": ("gpu", "gpu.arrays", "gpu.layout", "gpu.accel", "gpu.tables", "gpu.jit"),
    "service.worker": (*RUNS_KERNELS, "gpu.oidn"),
    "service.cli": ("gpu", "gpu.errors", "gpu.denoise"),
    "service.bench": (*RUNS_KERNELS, "gpu.layout", "gpu.accel"),
}
WITHOUT_GL = (
    "gpu.layout", "gpu.accel", "gpu.tables", "gpu.errors", "gpu.settings", "gpu.steps", "gpu.jit", "gpu.oidn",
    "gpu.denoise",
)  # fmt: skip
GL_SIDE = (
    "gpu.context",
    "gpu.kernels",
    "gpu.device",
    "gpu.picture",
    "gpu.bsdf",
    "gpu.precompile",
    "gpu.analysis",
    "gpu.renderer",
)
# The renderer's process; and the benchmarks, which measure the GPU side itself: the seconds of a sample, a tree's
# order, a merge. A door for them in the worker would only pass everything on.
TOUCHES_GL = ("service.worker", "service.bench")
OFFLINE = "gpu.tables.build"
SHARED_BY_PROCESSES = (
    "service.ipc", "service.system", "service.document.quality", "service.views", "service.displays"
)  # fmt: skip
ERRORS = ("gpu.errors", "service.problems")
WEB_FRAMEWORK = {"fastapi", "starlette", "uvicorn", "websockets", "pydantic"}

# The rooms of the editor, from the bottom to the top; "" is web/ itself.
WEB_ROOMS = "lib; server; document lobe; forms picture; panels renders; compare widget"
WEB_LAYERS = [*({*rooms.split()} for rooms in WEB_ROOMS.split(";")), {""}]
SPECIFIER = re.compile(r"""(?:\bfrom\s+|\bimport\s*\(\s*|\bimport\s+)["'](\.{1,2}/[^"']+)["']""")

Graph = Mapping[str, Iterable[str]]


def name_of(path: Path) -> str:
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


@cache
def tree_of(path: Path) -> ast.Module:
    return ast.parse(path.read_text())


@cache
def imports_of(path: Path) -> tuple[str, ...]:
    """Every module named by an import statement, also inside functions and under TYPE_CHECKING."""
    return tuple(_imports(path))


def _imports(path: Path) -> Iterator[str]:
    package = list(path.relative_to(ROOT).parent.parts)
    for node in ast.walk(tree_of(path)):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1] if node.level else []
            module = ".".join([*base, *(node.module or "").split(".")]).strip(".")
            # `from service import views` names service.views; `from gpu.errors import GpuError` gpu.errors.GpuError
            yield from (f"{module}.{alias.name}" for alias in node.names)


def within(module: str, *packages: str) -> bool:
    return any(module == package or module.startswith(package + ".") for package in packages)


def layer(module: str, layers: list[set[str]] = LAYERS) -> int:
    return next((i for i, packages in enumerate(layers) if within(module, *packages)), -1)


@cache
def graph() -> dict[str, set[str]]:
    """Module -> modules of ours that it imports."""
    ours = {name_of(path) for path in MODULES}
    found = {name_of(path): {existing(imported, ours) for imported in imports_of(path)} for path in MODULES}
    return {module: imported - {"", module} for module, imported in found.items()}


def existing(imported: str, ours: set[str]) -> str:
    """The module that an import names, or that has the imported name; "" for others'."""
    return imported if imported in ours else next((m for m in [imported.rpartition(".")[0]] if m in ours), "")


def circles(arrows: Graph) -> list[list[str]]:
    """Groups in which everybody is reached from everybody [Tarjan 1972]."""
    number, low, stack, found = dict[str, int](), dict[str, int](), list[str](), list[list[str]]()

    def visit(module: str) -> None:
        number[module] = low[module] = len(number)
        stack.append(module)
        for other in arrows.get(module, ()):
            if other not in number:
                visit(other)
                low[module] = min(low[module], low[other])
            elif other in stack:
                low[module] = min(low[module], number[other])
        if low[module] == number[module]:
            at = stack.index(module)
            group = stack[at:]
            del stack[at:]
            if len(group) > 1:
                found.append(sorted(group))

    for module in arrows:
        if module not in number:
            visit(module)
    return found


def folder_of(module: str) -> str:
    return module if (ROOT / module.replace(".", "/")).is_dir() else module.rpartition(".")[0]


@pytest.mark.parametrize("room", ["gpu", "service"])
def test_modules_keep_to_their_rooms(room: str) -> None:
    paths = [path for path in MODULES if within(name_of(path), room)]
    for module, imported in ((name_of(path), imported) for path in paths for imported in imports_of(path)):
        top = imported.split(".")[0]
        said = f"{module} imports {imported}"
        assert top != "tests", f"{said}: tests are not installed"
        if within(module, "gpu"):
            assert top != "service" and top not in WEB_FRAMEWORK, said
            assert top != "moderngl" or not within(module, *WITHOUT_GL), said
        else:
            assert top != "moderngl", said
        if module in ERRORS:
            assert top not in {"gpu", "service"}, said
        if top == "service" and module != "service":
            assert layer(imported) <= layer(module), f"{said}: that arrow points up"
        if top == "gpu" and within(module, "gpu") and module != "gpu":
            assert layer(imported, GPU_LAYERS) <= layer(module, GPU_LAYERS), f"{said}: that arrow points up"


@pytest.mark.parametrize("path", CLIENT, ids=lambda path: path.stem)
def test_client_talks_to_the_server_by_its_interface_alone(path: Path) -> None:
    """But for what writes its types from the schema. The service may need the client, and never the other way."""
    tops = {imported.split(".")[0] for imported in imports_of(path)}
    assert path.stem == "generate" or not tops & {"service", "gpu"}


def test_every_module_has_its_place() -> None:
    names = [name_of(path) for path in MODULES if name_of(path) not in ("gpu", "service")]
    assert [name for name in names if max(layer(name), layer(name, GPU_LAYERS)) < 0] == []


def test_only_public_rooms_of_gpu_are_looked_into() -> None:
    for module, imported in graph().items():
        for other in imported:
            said = f"{module} imports {other}"
            assert not within(other, OFFLINE) or within(module, OFFLINE), said
            if not within(other, "gpu") or within(module, "gpu"):
                continue
            rooms = [room for package, room in LOOKS_INTO_GPU.items() if within(module, package)]
            assert rooms, f"{said}: nobody there speaks to gpu"
            assert other == "gpu" or within(other, *rooms[0][1:]), f"{said}: that room is private"


def test_only_the_renderers_process_and_the_benchmarks_touch_gl() -> None:
    """Others get arrays, settings and errors from `gpu`, whose names count as the modules that they come from."""
    origin = {f"gpu.{name.rpartition('.')[2]}": name for name in imports_of(ROOT / "gpu" / "__init__.py")}
    for path in MODULES:
        module = name_of(path)
        if within(module, "service") and not within(module, *TOUCHES_GL):
            touched = [name for name in imports_of(path) if within(origin.get(name, name), *GL_SIDE)]
            assert touched == [], f"{module} imports {touched}: ask service/worker to do it"


def test_the_renderers_process_shares_only_its_channel() -> None:
    """The server imports nothing of the renderer's process, and that process nothing of the server but SHARED."""
    worker, server = "service.worker", ("service.renderers", "service.server")
    for module, imported in graph().items():
        for other in imported:
            said = f"{module} imports {other}"
            if within(module, *server):
                assert not within(other, worker, "gpu"), said
            if within(module, worker) and within(other, "service"):
                assert within(other, worker, *SHARED_BY_PROCESSES), said


def test_there_are_no_circles() -> None:
    assert circles(graph()) == []


def test_there_are_no_circles_in_the_client() -> None:
    """Nor between it and the service, of which it imports nothing."""
    paths = {".".join(path.relative_to(ROOT / "client" / "src").with_suffix("").parts): path for path in PACKAGE}
    arrows = {
        name: {existing(each, {*paths}) for each in imports_of(path)} - {"", name} for name, path in paths.items()
    }
    assert arrows["sunbox.client"] and circles(arrows) == []


def test_there_are_no_circles_between_folders() -> None:
    folders: dict[str, set[str]] = {}
    for module, imported in graph().items():
        mine = folder_of(module)
        others = {folder_of(other) for other in imported}
        folders.setdefault(mine, set()).update(o for o in others if not within(o, mine) and not within(mine, o))
    assert circles(folders) == []


def test_a_circle_is_seen() -> None:
    assert circles({"a": ["b"], "b": ["c"], "c": ["b", "d"], "d": []}) == [["b", "c"]]


def test_files_are_not_too_long() -> None:
    long = {str(path.relative_to(ROOT)) for path in SOURCES if len(path.read_text().splitlines()) > MOST_LINES}
    assert long == LONG.keys(), "ask what their second subjects are"


@pytest.mark.parametrize("folder", FOLDERS, ids=lambda folder: str(folder.relative_to(ROOT)))
def test_folder_has_a_table_of_contents(folder: Path) -> None:
    """The docstring of `__init__.py` has a line for each module, `name  what it holds`, and for nothing else."""
    contents = ast.get_docstring(ast.parse((folder / "__init__.py").read_text())) or ""
    lines = re.findall(r"^(\w+(?:, \w+)*) {2,}\S", contents, re.MULTILINE)
    listed = {name for line in lines for name in line.split(", ")}
    modules = {path.stem for path in folder.glob("*.py") if not path.stem.startswith("test_")} - {"__init__"}
    folders = {path.parent.name for path in folder.glob("*/__init__.py")}
    assert listed == modules | folders


@cache
def classes() -> dict[str, ast.ClassDef]:
    """By module and name."""
    found: dict[str, ast.ClassDef] = {}
    for path in MODULES:
        for node in ast.walk(tree_of(path)):
            if isinstance(node, ast.ClassDef):
                found[f"{name_of(path)}.{node.name}"] = node
    return found


def bases(name: str) -> Iterator[str]:
    """The class and those of ours that it is made from."""
    yield name
    for base in classes()[name].bases:
        called = ast.unparse(base).partition("[")[0].rpartition(".")[2]
        module = name.rpartition(".")[0]
        known = [each for each in classes() if each.rpartition(".")[2] == called]
        imported = {each for path in MODULES if name_of(path) == module for each in imports_of(path)}
        for each in known:
            if each in imported or each.rpartition(".")[0] == module:
                yield from bases(each)


def is_data(node: ast.ClassDef) -> bool:
    frozen = any("frozen=True" in ast.unparse(each) for each in node.decorator_list)
    return frozen or any(ast.unparse(base).partition("[")[0].rpartition(".")[2] in DATA for base in node.bases)


def members(node: ast.ClassDef) -> tuple[set[str], set[str]]:
    """The methods of a class, and the attributes that they or the class set."""
    methods = {each.name: each for each in node.body if isinstance(each, ast.FunctionDef | ast.AsyncFunctionDef)}
    fields = {ast.unparse(each.target) for each in node.body if isinstance(each, ast.AnnAssign)}
    for method in methods.values():
        fields |= {
            each.attr
            for each in ast.walk(method)
            if isinstance(each, ast.Attribute)
            and isinstance(each.ctx, ast.Store)
            and ast.unparse(each.value) == "self"
        }
    return set(methods), fields


def test_classes_have_one_subject() -> None:
    large = dict[str, str]()
    for name in classes():
        family = [classes()[each] for each in bases(name)]
        methods, fields = (set[str]().union(*parts) for parts in zip(*map(members, family), strict=True))
        if len(methods) > MOST_METHODS or (len(fields) > MOST_ATTRIBUTES and not any(map(is_data, family))):
            large[name] = f"{len(methods)} methods, {len(fields)} attributes"
    assert large.keys() == LARGE_CLASSES.keys(), f"{large}: ask what their second subjects are"


def test_shaders_are_text() -> None:
    assert not list(ROOT.glob("shaders/**/*.py")) and not list(ROOT.glob("web/**/*.py"))


def test_modules_of_the_editor_keep_to_their_rooms() -> None:
    web = ROOT / "web"
    arrows: dict[str, set[str]] = {}
    for path in web.glob("**/*.js"):
        found = ((path.parent / each).resolve() for each in SPECIFIER.findall(path.read_text()))
        arrows[str(path.relative_to(web))] = {str(other.relative_to(web)) for other in found}
    height = {room: i for i, rooms in enumerate(WEB_LAYERS) for room in rooms}
    for module, imported in arrows.items():
        for other in imported:
            assert (web / other).is_file(), f"{module} imports {other}, which is not there"
            mine, its = (each.rpartition("/")[0] for each in (module, other))
            assert mine == its or height[its] < height[mine], f"{module} imports {other}: that arrow points up"
    assert circles(arrows) == []


def test_neither_the_editor_nor_a_route_knows_a_material_model() -> None:
    """They ask the schema and the server's functions, so that a new model needs no line there."""
    routes = (path for path in ROOT.glob("service/server/routes/*.py") if path.stem != "examples")
    for path in (*ROOT.glob("web/**/*.js"), *ROOT.glob("web/*.html"), *routes):
        for name in NUMBERS:
            assert not re.search(rf"""["']{name}["']|\b{name}:""", path.read_text()), f"{path.name} knows {name}"


def test_no_lobe_light_or_shape_includes_a_sibling() -> None:
    """What puts the kinds together includes them; they know nothing of each other."""
    for path in LEAVES:
        folder = str(path.parent.relative_to(ROOT / "shaders"))
        for included in re.findall(r'^\s*#\s*include\s+"([^"]+)"', path.read_text(), re.MULTILINE):
            assert not included.startswith(f"{folder}/"), f"{path.relative_to(ROOT)} includes its sibling {included}"


def test_no_test_file_takes_anything_from_another() -> None:
    """Nor do the programs that it has in quotes: what two of them need stands in a module that says so."""
    pattern = re.compile(r"^\s*(?:from|import) tests(?:\.\w+)*(?:\.| import (?:\w+, )*)(test_\w+)", re.MULTILINE)
    assert pattern.findall("from tests.gpu.test_a import b\nfrom tests.gpu import c, test_d") == ["test_a", "test_d"]
    for path in TESTS.glob("**/*.py"):
        taken = set(pattern.findall(path.read_text())) - {path.stem}
        assert not taken, f"{path.relative_to(ROOT)} imports from {taken}"


def test_the_long_test_files_are_there() -> None:
    assert not [name for name in LONG_FILES if not (TESTS / name).exists()]
