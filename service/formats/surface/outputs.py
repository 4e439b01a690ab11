"""What the models' writers give: the inputs of a material of the document, whose values are the document's."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from service.document.material import PrincipledMaterial
from service.document.material.principled import index_of_specular, roughness_of_gloss
from service.document.texture import ColorTexture, ScalarTexture

WHITE = (1.0, 1.0, 1.0)
Tell = Callable[[str, str], None]  # told of what is lost: of which parameter, and how


class Output(NamedTuple):
    """The value of an input: a number, a switch, a colour or a texture; and the parameter that it comes from."""

    value: Any
    parameter: str


Outputs = dict[str, Output]


def plain(value: Any) -> Any:
    """A number or a colour, or the factor of its texture."""
    return value.factor if isinstance(value, ScalarTexture | ColorTexture) else value


def is_used(value: Any) -> bool:
    found = plain(value)
    return bool(max(found) > 0 if isinstance(found, tuple) else found > 0)


def scaled(value: Any, factor: float) -> Any:
    """A number, or its texture, times a factor."""
    if isinstance(value, ScalarTexture):
        return value.model_copy(update={"factor": value.factor * factor})
    return value * factor


def number(value: Any, parameter: str, tell: Tell) -> float:
    """The number of an input that no format has a texture for."""
    if isinstance(value, ScalarTexture):
        tell(parameter, "a texture of it is not written; its factor is")
    return float(plain(value))


# Parameters of `principled` that stand for others.


def index(m: PrincipledMaterial) -> tuple[Output, Output | None]:
    """The index of refraction, and the weight of its reflection where that is a texture."""
    if m.ior is not None:
        return Output(m.ior, "ior"), None
    if isinstance(m.specular, ScalarTexture):
        whole = m.specular.model_copy(update={"factor": 1.0})
        return Output(index_of_specular(min(m.specular.factor, 1.0)), "specular"), Output(whole, "specular")
    return Output(index_of_specular(m.specular), "specular"), None


def specular_color(m: PrincipledMaterial, tell: Tell) -> Any:
    """The colour of the reflection, with the hue that its tint takes from the base."""
    tint = _tinted(m, m.specular_tint, "specular_tint", tell)
    if tint == WHITE:
        return m.specular_color
    by = tuple(a * b for a, b in zip(plain(m.specular_color), tint, strict=True))
    if isinstance(m.specular_color, ColorTexture):
        return m.specular_color.model_copy(update={"factor": by})
    return by


def sheen_color(m: PrincipledMaterial, tell: Tell) -> Any:
    return _tinted(m, m.sheen_tint, "sheen_tint", tell) if m.sheen_color is None else m.sheen_color


def coat_roughness(m: PrincipledMaterial, tell: Tell) -> Output:
    if m.clearcoat_roughness is not None:
        return Output(m.clearcoat_roughness, "clearcoat_roughness")
    gloss = number(m.clearcoat_gloss, "clearcoat_gloss", tell)
    return Output(roughness_of_gloss(min(gloss, 1.0)), "clearcoat_gloss")


def _tinted(m: PrincipledMaterial, share: Any, parameter: str, tell: Tell) -> tuple[float, ...]:
    """White tinted to the base's hue by a share, as bsdf/models/principled.glsl has it."""
    if not is_used(share):
        return WHITE
    if isinstance(share, ScalarTexture) or isinstance(m.base_color, ColorTexture):
        tell(parameter, "it is not written where it, or what it tints, is a texture")
        return WHITE
    most = max(m.base_color)
    return tuple(1 + share * (each / most - 1) for each in m.base_color) if most > 0 else WHITE
