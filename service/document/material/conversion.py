"""A material turned into another model: what both know stays, and so do the colour and the width of the highlight.

It works on documents, so that hexadecimal colours and textures stay as they were written. What a parameter means is
read from the schema's hints; no model is known by name.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

from service.document.color import color
from service.document.material.surface import AnySurface
from service.document.numbers import BRIGHTEST, rounded

Document = dict[str, Any]

BASE_F0 = 0.04  # head-on reflectance of a dielectric of index 1.5
LEAST_ROUGHNESS = 0.05  # of those that become an exponent, which would be infinite for 0
ALPHA = (0.001, 10.0)  # of the distribution that a model of microfacets begins with
_WIDTHS = ("roughness", "base_color", "metallic")  # what the highlight of another model follows from
_linear = color(BRIGHTEST)


@dataclass(frozen=True)
class Converted:
    """The material, and the names of the parameters that the new model has nothing for."""

    material: Document
    lost: list[str]


@dataclass(frozen=True)
class Parameter:
    """A parameter of a model, as the schema describes it."""

    name: str
    hints: Mapping[str, Any]
    options: tuple[Mapping[str, Any], ...]  # the forms that its value may have
    is_required: bool

    @property
    def known_as(self) -> str:
        """The name by which other models may know it."""
        return str(self.hints.get("x-known-as", self.name))

    @property
    def default(self) -> Any:
        """The value where a document leaves it out; None where the schema does not say."""
        return self.hints.get("default")

    @property
    def takes_texture(self) -> bool:
        return any("texture" in option.get("properties", {}) for option in self.options)

    @property
    def choices(self) -> list[str] | None:
        """The values of a menu."""
        return next((option["enum"] for option in self.options if "enum" in option), None)

    @property
    def file_kind(self) -> str | None:
        """The kind of the file that it refers to, where it refers to one."""
        found = self.hints.get("x-asset")
        return None if found is None else str(found["kind"])

    @property
    def middle(self) -> float:
        """The middle of its slider."""
        number = next(option for option in self.options if option.get("type") == "number")
        low, high = (self.hints.get(f"x-soft-{end}", number.get(end)) for end in ("minimum", "maximum"))
        return float(low + high) / 2

    def means(self, other: Parameter | None) -> bool:
        """True if it means the same as that of another model. `specular` is an amount here and a colour there;
        `alpha` is the opacity, or a distribution's parameter whose range depends on that."""
        return other is not None and all(self.hints.get(n) == other.hints.get(n) for n in ("x-widget", "x-ranges"))


def converted(old: Document, before: type[AnySurface], after: type[AnySurface]) -> Converted:
    """`old`, a valid document of the model `before`, as one of the model `after`, which may want a file still."""
    if before is after:
        return Converted(dict(old), [])
    was, wanted = parameters(before), parameters(after)
    material: Document = {"type": after.name()}
    used = {"type"}
    theirs = {p.known_as: p for p in was.values()}
    for name, parameter in wanted.items():
        other = theirs.get(parameter.known_as)
        if other is None or not parameter.means(other):
            continue
        value = old.get(other.name)
        if value is None and other.default != parameter.default:  # left out, it would look different
            value = other.default
        if value is not None and (parameter.takes_texture or not isinstance(value, dict)):
            material[name] = value
            used.add(other.name)
    given, color = _color_name(was, old), _color_name(wanted, {})
    if given and color and given not in material:
        material[color] = old.get(given, was[given].hints.get("default"))
        used.add(given)
    make = _HIGHLIGHTS.get(_highlight(wanted).get("as", ""))
    if make is not None and color is not None and _is_plain(old):
        material |= make(old, _highlight(wanted)) | {color: _diffuse(old)}
        used.update(_WIDTHS)
    for name, parameter in wanted.items():  # what this model asks for and the other has not
        if parameter.is_required and name not in material and not parameter.choices and not parameter.file_kind:
            material[name] = parameter.middle
    used |= before.left(old, material) | after.taken(old, material)
    return Converted(material, [name for name in old if name not in used])


@cache
def parameters(model: type[AnySurface]) -> dict[str, Parameter]:
    """The parameters of a model by name, in the order of the schema."""
    schema = model.model_json_schema()

    def options(node: Mapping[str, Any]) -> Iterator[Mapping[str, Any]]:
        forms = node.get("anyOf", node.get("oneOf"))
        if forms is not None:
            for form in forms:
                yield from options(form)
        else:
            yield schema["$defs"][node["$ref"].rpartition("/")[2]] if "$ref" in node else node

    required = schema.get("required", [])
    return {
        name: Parameter(name, hints, tuple(options(hints)), name in required)
        for name, hints in schema["properties"].items()
        if name != "type"
    }


def _highlight(of: Mapping[str, Parameter]) -> Mapping[str, Any]:
    """The schema's entry for the width of the highlight: {field, as, color}; empty where there is none."""
    found = ({"field": p.name} | p.hints["x-highlight"] for p in of.values() if "x-highlight" in p.hints)
    return next(found, {})


def _color_name(of: Mapping[str, Parameter], document: Document) -> str | None:
    """The name of a model's colour: the first of its base, or where that is black the reflectance of its facets."""
    base = [p for p in of.values() if p.hints.get("x-widget") == "color" and p.hints.get("x-group") == "Base"]
    if not base:
        return None
    highlight, first = _highlight(of), base[0]
    facets = highlight["color"] if highlight.get("as") == "alpha" else None
    value = document.get(first.name, first.hints.get("default"))
    is_black = facets in document and not isinstance(value, dict) and max(_linear(value)) == 0
    return facets if is_black else first.name


def _is_plain(old: Document) -> bool:
    """True if it has a roughness, and no texture decides on the highlight."""
    return "roughness" in old and not any(isinstance(old.get(name), dict) for name in _WIDTHS)


def _share(x: float) -> float:
    return rounded(min(1.0, x), 4)


def _diffuse(old: Document) -> list[float]:
    return [_share(x * (1 - old.get("metallic", 0))) for x in _linear(old.get("base_color", 0.5))]


def _reflectance(old: Document) -> list[float]:
    """Head-on, of each channel."""
    metallic = old.get("metallic", 0)
    return [BASE_F0 * (1 - metallic) + x * metallic for x in _linear(old.get("base_color", 0.5))]


def _facets(old: Document, highlight: Mapping[str, Any]) -> Document:
    alpha = rounded(min(max(old["roughness"] ** 2, ALPHA[0]), ALPHA[1]), 4)
    return {highlight["field"]: alpha, highlight["color"]: [_share(x) for x in _reflectance(old)]}


def _exponent(old: Document, highlight: Mapping[str, Any]) -> Document:
    """Blinn and Phong's highlight for a roughness: its exponent 2 / alpha^2 - 2, alpha being roughness^2, and the
    reflectance at normal incidence times (exponent + 8) / 8, the normalisation that this model leaves out
    [Akenine-Moeller et al., Real-Time Rendering]."""
    n = rounded(max(0.0, 2 / max(old["roughness"], LEAST_ROUGHNESS) ** 4 - 2), 3)
    return {highlight["field"]: n, highlight["color"]: [_share(x * (n + 8) / 8) for x in _reflectance(old)]}


def _mirrored_exponent(old: Document, highlight: Mapping[str, Any]) -> Document:
    """About the mirrored direction angles are twice those of half vectors: a quarter of the exponent has the same
    width."""
    made = _exponent(old, highlight)
    return made | {highlight["field"]: rounded(made[highlight["field"]] / 4, 3)}


# From a roughness, by what the schema says that the width of the highlight is.
_HIGHLIGHTS: dict[str, Callable[[Document, Mapping[str, Any]], Document]] = {
    "alpha": _facets,
    "exponent": _exponent,
    "mirrored exponent": _mirrored_exponent,
}
