"""KHR_materials_variants: the names of a file's variants, and the materials of one of them.

A variant is written into the primitives of the file's JSON, as if the file had these materials.
"""

from __future__ import annotations

from service.formats.errors import ParseError
from service.formats.read.gltf.document import GltfDocument
from service.formats.read.gltf.json_view import JsonView, shown, whole
from service.formats.read.scenes.names import unique

NAME = "KHR_materials_variants"
MOST = 1000  # variants that are listed, as an untrusted file may have any number


def listed(file: GltfDocument) -> list[str]:
    """The variants' names; of several equal ones the later are numbered."""
    extension = file.root.extension(NAME)
    names: dict[str, None] = {}
    for k, place in enumerate(extension.objects("variants") if extension else ()):
        if k == MOST:
            break
        names[unique(place.text("name") or f"Variant {k + 1}", names)] = None
    return list(names)


def choose(file: GltfDocument, name: str) -> None:
    """Give each primitive its material of a variant; those that have none keep the one they have.

    Raises ParseError.
    """
    names = listed(file)
    if name not in names:
        raise ParseError(f"there is no variant {shown(name)}", f"/extensions/{NAME}/variants")
    number = names.index(name)
    for mesh in file.root.objects("meshes"):
        for primitive in mesh.objects("primitives"):
            mapped = primitive.extension(NAME)
            for mapping in mapped.objects("mappings") if mapped else ():
                if number in _variants(mapping):
                    primitive.value["material"] = mapping.whole("material")
                    break


def _variants(mapping: JsonView) -> list[int]:
    return [whole(one, f"{mapping.at('variants')}/{k}") for k, one in enumerate(mapping.array("variants"))]
