"""Writes src/sunbox/widget/, the notebook's view as one ES module and its style: python bundle.py

They come from web/widget and what that takes from the editor's modules.

A front end takes a widget's code as one text. Each module becomes a function that returns what others import from it;
declarations that nobody needs, comments and spaces are left out. It relies on Biome's format: what a module declares
begins at the left margin, and what belongs to it does not.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path

WEB = Path(__file__).parents[1] / "web"
ENTRY = "widget/widget.js"
STYLE = "widget/widget.css"
TARGET = Path(__file__).parent / "src" / "sunbox" / "widget"
HEAD = "// Written by client/bundle.py from web/widget/ and what it imports.\n"
IMPORT = re.compile(r'^import \{([^}]*)\} from "([^"]+)";$', re.MULTILINE)
WORD = re.compile(r"(?:(?<=\.\.\.)|(?<![.\w$]))[A-Za-z_$][\w$]*")  # no member of something
DECLARATION = re.compile(r"^(?:export )?(?:async )?(?:const|let|function|class) (?:\{([^}]*)\}|\[([^\]]*)\]|(\w+))")


@dataclass
class Module:
    """Its imports, {name: (module, name there)}, and its statements, each with the names that it declares."""

    imports: dict[str, tuple[str, str]] = field(default_factory=dict)
    statements: list[tuple[set[str], str]] = field(default_factory=list)
    needed: set[str] = field(default_factory=set)
    kept: set[int] = field(default_factory=set)


def bundle(web: Path = WEB) -> str:
    """The text of the module."""
    modules = _modules(web, ENTRY)
    _need(modules, ENTRY, set())
    parts = [_function(path, modules[path]) for path in _ordered(modules, ENTRY) if modules[path].kept]
    return HEAD + "\n".join(parts) + f"\nexport default {_variable(ENTRY)}.default;\n"


def _modules(web: Path, path: str) -> dict[str, Module]:
    found: dict[str, Module] = {}
    waiting = [path]
    while waiting:
        path = waiting.pop()
        if path in found:
            continue
        found[path] = module = _parsed(path, (web / path).read_text("utf-8"), web)
        waiting += [other for other, _ in module.imports.values()]
    return found


def _parsed(path: str, text: str, web: Path) -> Module:
    module = Module()
    for names, source in IMPORT.findall(text):
        other = ((web / path).parent / source).resolve().relative_to(web.resolve()).as_posix()
        for name in filter(None, map(str.strip, names.split(","))):
            theirs, _, ours = name.partition(" as ")
            module.imports[ours or theirs] = (other, theirs)
    text = IMPORT.sub("", text).replace("export default ", "const $default = ")
    assert not re.search(r"^import\b", text, re.MULTILINE), (
        f"{path}: an import of a kind that bundle.py does not know"
    )
    assert all(line.count("`") % 2 == 0 for line in text.splitlines()), f"{path}: a text over several lines"
    for statement in re.split(r"\n(?=[A-Za-z$])", "\n" + _bare(text)):
        if statement.strip():
            module.statements.append((_declared(statement.strip()), statement.strip()))
    return module


def _bare(text: str) -> str:
    """Without lines of comment and what follows code as comment."""
    lines = (re.sub(r"\s+// .*$", "", line) for line in text.splitlines() if not line.lstrip().startswith("//"))
    return "\n".join(line for line in lines if line.strip())


def _declared(statement: str) -> set[str]:
    found = DECLARATION.match(statement)
    if found is None:
        return {"$default"} if statement.startswith("const $default") else set()
    return set(re.findall(r"[\w$]+", next(filter(None, found.groups()))))


def _need(modules: dict[str, Module], path: str, names: set[str]) -> None:
    """Keeps what declares these names of a module, what acts by itself, and all that these need."""
    module = modules[path]
    module.needed |= names
    for place, (declared, statement) in enumerate(module.statements):
        if place in module.kept or (declared and not declared & (module.needed | {"$default"})):
            continue
        module.kept.add(place)
        words = set(WORD.findall(statement))
        for name, (other, theirs) in module.imports.items():
            if name in words:
                _need(modules, other, {theirs})
        _need(modules, path, words & {name for each, _ in module.statements for name in each})


def _ordered(modules: dict[str, Module], path: str, seen: set[str] | None = None) -> list[str]:
    """What is imported comes before what imports it."""
    seen = set() if seen is None else seen
    if path in seen:
        return []
    seen.add(path)
    below = dict.fromkeys(other for other, _ in modules[path].imports.values())
    return [*(each for other in below for each in _ordered(modules, other, seen)), path]


def _tight(line: str) -> str:
    """Without spaces beside what needs none, outside of texts; a line that may hold a pattern or a text with other
    quotes stays as it is."""
    if re.search(r"['`/]", line):
        return line
    parts = re.split(r'("(?:[^"\\]|\\.)*")', line)  # every second one is a text
    parts[::2] = [re.sub(r"\s*(=>|[={}(),;:<>|&])\s*", r"\1", part) for part in parts[::2]]
    return "".join(parts)


def _variable(path: str) -> str:
    return re.sub(r"\W", "_", path.removesuffix(".js"))


def _function(path: str, module: Module) -> str:
    text = "\n".join(statement for place, (_, statement) in enumerate(module.statements) if place in module.kept)
    words = set(WORD.findall(text))
    taken: dict[str, list[str]] = {}
    for name, (other, theirs) in module.imports.items():
        if name in words:
            taken.setdefault(other, []).append(name if name == theirs else f"{theirs}: {name}")
    lines = [f"const {{ {', '.join(names)} }} = {_variable(other)};" for other, names in taken.items()]
    lines += [_tight(line.strip().removeprefix("export ")) for line in text.splitlines()]
    given = sorted(set(re.findall(r"^export (?:async )?(?:const|let|function|class) (\w+)", text, re.MULTILINE)))
    given += ["default: $default"] if "$default" in words else []
    return "\n".join([f"const {_variable(path)} = (() => {{", *lines, f"return {{ {', '.join(given)} }};", "})();"])


if __name__ == "__main__":
    TARGET.mkdir(exist_ok=True)
    (TARGET / "widget.js").write_text(bundle())
    (TARGET / "widget.css").write_text((WEB / STYLE).read_text())
