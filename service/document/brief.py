"""A material's model in few words: what a person, or a program that reads text, needs to write one."""

from __future__ import annotations

from typing import Any

Schema = dict[str, Any]


def model_schema(scene: Schema, model: str) -> Schema | None:
    """The schema of a material's model, with what it refers to in `$defs`; None where there is no such model.
    `scene`: the schema of the scene."""
    definitions: Schema = scene["$defs"]
    materials = {name: each for name, each in definitions.items() if name.endswith("Material")}
    name = next((name for name, each in materials.items() if _type(each) == model), None)
    if name is None:
        return None
    needed, found = [name], dict[str, Schema]()
    while needed:
        each = needed.pop()
        found[each] = definitions[each]
        needed += [ref for ref in _references(found[each]) if ref not in found]
    return {**found.pop(name), "$defs": found}


def brief(schema: Schema) -> Schema:
    """Of a model's schema: a line for each field with its range, unit and default."""
    fields = {name: _field(each) for name, each in schema["properties"].items() if name != "type"}
    described = {"type": schema["properties"]["type"]["const"], "description": schema.get("description", "")}
    return described | {"required": [name for name in schema.get("required", ()) if name != "type"], "fields": fields}


def _field(field: Schema) -> Schema:
    forms = field.get("anyOf", [field])
    numbers = [form for form in forms if form.get("type") in ("number", "integer")]
    out: Schema = {"is": _kind(field, forms)}
    for form in numbers[:1]:
        least, most = form.get("exclusiveMinimum"), form.get("exclusiveMaximum")
        out["range"] = [form.get("minimum", least), form.get("maximum", most)]
    if field.get("x-unit"):
        out["unit"] = field["x-unit"]
    if "default" in field:
        out["default"] = field["default"]
    if "description" in field:
        out["about"] = field["description"]
    return out


def _kind(field: Schema, forms: list[Schema]) -> str:
    choices = [each for form in forms for each in form.get("enum", [form["const"]] if "const" in form else [])]
    if choices:
        return " | ".join(map(str, choices))
    kinds = {form.get("type") for form in forms}
    textured = any("Texture" in form.get("$ref", "") for form in forms)
    names = ("number", "integer", "boolean", "string", "array")
    kind = next((each for each in names if each in kinds), "object")
    if field.get("x-widget") == "color":
        kind = "colour: [r, g, b], #rrggbb or a number"
    return f"{kind}, or {{texture: NAME}}" if textured else kind


def _type(definition: Schema) -> str | None:
    found: str | None = definition.get("properties", {}).get("type", {}).get("const")
    return found


def _references(node: Any) -> list[str]:
    if isinstance(node, dict):
        own = [node["$ref"].rpartition("/")[2]] if isinstance(node.get("$ref"), str) else []
        return own + [ref for value in node.values() for ref in _references(value)]
    return [ref for value in node for ref in _references(value)] if isinstance(node, list) else []
