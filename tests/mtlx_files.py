"""MaterialX files, written element by element, and what is read from them."""

from __future__ import annotations

from html import escape
from typing import Any

from service.document.document import check_saved_material
from service.formats.scene_import import Imported
from service.server.assets import AssetStore
from tests.obj_files import zipped

HEAD = '<?xml version="1.0"?>\n<materialx version="1.39"{0}>\n'


def value(name: str, of: object, type: str = "", **attributes: str) -> str:
    """An input with a value; three numbers are a colour unless `type` says otherwise."""
    text = ", ".join(map(str, of)) if isinstance(of, list | tuple) else str(of)
    kind = type or ("color3" if isinstance(of, list | tuple) else "string" if isinstance(of, str) else "float")
    more = "".join(f' {key}="{each}"' for key, each in attributes.items())
    return f'<input name="{name}" type="{kind}" value="{escape(text)}"{more}/>'


def wire(name: str, node: str, type: str = "color3", output: str = "") -> str:
    """An input that is connected to a node beside it."""
    more = f' output="{output}"' if output else ""
    return f'<input name="{name}" type="{type}" nodename="{node}"{more}/>'


def from_graph(name: str, output: str, type: str = "color3") -> str:
    """An input that is connected to an output of the graph NG."""
    return f'<input name="{name}" type="{type}" nodegraph="NG" output="{output}"/>'


def node(category: str, name: str, type: str, *inputs: str) -> str:
    return f'<{category} name="{name}" type="{type}">{"".join(inputs)}</{category}>'


def graph(*nodes: str, **outputs: str) -> str:
    """The graph NG; each output is "node type" or "node type output"."""
    made = []
    for name, text in outputs.items():
        source, type, *more = text.split()
        own = f' output="{more[0]}"' if more else ""
        made.append(f'<output name="{name}" type="{type}" nodename="{source}"{own}/>')
    return f'<nodegraph name="NG">{"".join(nodes)}{"".join(made)}</nodegraph>'


def surface(model: str, *inputs: str, name: str = "M") -> str:
    """A material of one shader, whose node is called S and the material's name."""
    shader = node(model, f"S{name}", "surfaceshader", *inputs)
    wired = wire("surfaceshader", f"S{name}", "surfaceshader")
    return shader + node("surfacematerial", name, "material", wired)


def mtlx(*elements: str, space: str = "") -> bytes:
    """A document; `space` is its colour space."""
    head = HEAD.format(f' colorspace="{space}"' if space else "")
    return (head + "\n".join(elements) + "\n</materialx>").encode()


def taken(store: AssetStore, files: bytes | dict[str, bytes]) -> Imported:
    info = store.add(files if isinstance(files, bytes) else zipped(files))
    assert info.kind == "materials"
    imported = store.materials(info.id)
    for name, material in imported.document["materials"].items():
        shown = [each["texture"] for each in material.values() if isinstance(each, dict)]
        textures = {each: imported.document["textures"][each] for each in shown}
        check_saved_material({"materials": {name: material}, "textures": textures})
    return imported


def material(imported: Imported) -> dict[str, Any]:
    (only,) = imported.document["materials"].values()
    return only


def losses(imported: Imported) -> set[str]:
    return {warning["pointer"] for warning in imported.warnings}
