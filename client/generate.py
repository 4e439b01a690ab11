"""Writes src/sunbox/document.py, the scene's document as types, from the service's schema: python generate.py"""

from __future__ import annotations

import keyword
import textwrap
from pathlib import Path
from typing import Any

TARGET = Path(__file__).parent / "src" / "sunbox" / "document.py"
HEAD = '''"""The scene's document as types: dicts whose members an editor and a type checker know.

    from sunbox.document import DiffuseMaterial, PerspectiveCamera, Scene, SphereShape

    scene: Scene = {"version": 1, "camera": PerspectiveCamera(position=[0, 1, 4], target=[0, 1, 0]), ...}

Written by generate.py from the service's schema; a test holds it to that.
"""

from typing import Any, Literal, Required, TypedDict  # evaluated now: else a TypedDict does not see what is required

'''
TYPES = {"number": "float", "integer": "int", "string": "str", "boolean": "bool", "null": "None"}
WIDTH = 118


def module(schemas: dict[str, Any]) -> str:
    """The text of `document`, of what `GET /v1/schema` answers."""
    scene, settings = schemas["scene"], schemas["settings"]
    classes = [_class(name, scene["$defs"][name]) for name in _ordered(scene["$defs"])]
    unions = [_union(name, members) for name, members in _unions(scene["properties"]).items()]
    return HEAD + "\n\n".join([*classes, *unions, _class("Scene", scene), _class("Settings", settings)])


def _union(name: str, members: list[str]) -> str:
    return "\n".join([f"{name} = (", f"    {members[0]}", *(f"    | {member}" for member in members[1:]), ")", ""])


def _unions(value: Any) -> dict[str, list[str]]:
    """The models that may stand in one place, by what their names end with: SphereShape | BoxShape is a Shape."""
    found: dict[str, list[str]] = {}
    if isinstance(value, dict):
        members = [each["$ref"].rpartition("/")[2] for each in value.get("oneOf", ()) if "$ref" in each]
        if len(members) > 2:
            found[_ending(members)] = members
        for each in value.values():
            found |= _unions(each)
    return found


def _ending(names: list[str]) -> str:
    """The longest that all of them end with."""
    return next(names[0][i:] for i in range(len(names[0])) if all(name.endswith(names[0][i:]) for name in names))


def _ordered(definitions: dict[str, Any]) -> list[str]:
    """Each after those that it holds, so that a reader meets them in this order."""
    ordered: list[str] = []

    def visit(name: str) -> None:
        for other in sorted(definitions):
            if f'"#/$defs/{other}"' in repr(definitions[name]).replace("'", '"') and other not in ordered:
                visit(other)
        if name not in ordered:
            ordered.append(name)

    for name in sorted(definitions):
        visit(name)
    return ordered


def _class(name: str, schema: dict[str, Any]) -> str:
    required = set(schema.get("required", ()))
    lines = [f"class {name}(TypedDict, total=False):", *_doc(schema.get("description", ""))]
    for member, field in schema["properties"].items():
        if keyword.iskeyword(member):
            raise ValueError(f"{name}.{member}: a keyword needs the other way to write a TypedDict")
        kind = _type(field)
        lines.append(f"    {member}: {f'Required[{kind}]' if member in required else kind}")
        lines += _doc(_field_text(field))
    return "\n".join(lines) + "\n"


def _field_text(field: dict[str, Any]) -> str:
    """What a field means, in which unit and range, and what it is when it is left out."""
    text = field.get("description", "")
    facts = [field.get("x-unit", ""), _range(field)]
    if "default" in field:
        facts.append(f"default {field['default']!r}")
    said = ", ".join(fact for fact in facts if fact)
    return f"{text} ({said})" if said and text else text or said


def _range(field: dict[str, Any]) -> str:
    for one in (field, *field.get("anyOf", ())):
        low = one.get("minimum", one.get("exclusiveMinimum"))
        high = one.get("maximum", one.get("exclusiveMaximum"))
        if low is not None and high is not None:
            return f"{low:g} to {high:g}" if abs(low) < 1e9 else ""
        if low is not None:
            return f"at least {low:g}" if "minimum" in one else f"above {low:g}"
    return ""


def _doc(text: str) -> list[str]:
    if not text:
        return []
    quoted = text.replace("\\", "\\\\")
    return textwrap.wrap(f'"""{quoted}"""', WIDTH, initial_indent="    ", subsequent_indent="    ")


def _type(field: dict[str, Any]) -> str:
    if "$ref" in field:
        return str(field["$ref"].rpartition("/")[2])
    if "const" in field:
        return f"Literal[{_literal(field['const'])}]"
    if "enum" in field:
        return f"Literal[{', '.join(map(_literal, field['enum']))}]"
    for union in ("anyOf", "oneOf"):
        if len(field.get(union, ())) > 2 and all("$ref" in each for each in field[union]):
            return _ending([_type(each) for each in field[union]])
        if union in field:
            return " | ".join(dict.fromkeys(map(_type, field[union])))
    if field.get("type") == "array":
        return f"list[{_type(field.get('items', {}))}]"
    if field.get("type") == "object":
        others = field.get("additionalProperties")
        return f"dict[str, {_type(others) if isinstance(others, dict) else 'Any'}]"
    return TYPES.get(field.get("type", ""), "Any")


def _literal(value: Any) -> str:
    return f'"{value}"' if isinstance(value, str) else repr(value)


if __name__ == "__main__":
    from service.document.schema import schema

    TARGET.write_text(module(schema()))
