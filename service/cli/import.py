"""`sunbox import MODEL -o SCENE.json`: a model as a document, its meshes and images in files beside it; likewise the
materials of a zip or a folder of textures, and the document of a picture that Sunbox made."""

from __future__ import annotations

import argparse
import json
import math
import sys
import tempfile
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING

from service.cli import BadInput, configuration, files
from service.cli.documents import asset_folders, picture_size, read_settings, refusals

if TYPE_CHECKING:
    from service.formats.scene_import import Imported
    from service.formats.types import Pose


def run(arguments: argparse.Namespace) -> int:
    source = Path(arguments.model)
    target = files.writable(Path(arguments.output))
    config = configuration()
    from service.cli.models import import_model, is_model, zipped_images
    from service.document import presets, references
    from service.formats.images.metadata import metadata_text
    from service.formats.types import Pose
    from service.server.assets import AssetStore, FileAssets

    data = zipped_images(source) if source.is_dir() else files.read(source)
    if metadata_text(data) is not None:
        return _picture(source, target)
    if not is_model(source, data) and not data.lstrip(b"\xef\xbb\xbf \t\r\n").startswith(b"{"):
        raise BadInput(
            f"{str(source)!r}: is no model: neither glTF, nor OBJ, PLY, STL, USD, nor a zip, nor a folder of textures"
        )
    if arguments.time is not None and arguments.animation is None:
        raise BadInput("--time: needs --animation beside it")
    if arguments.time is not None and not math.isfinite(arguments.time):
        raise BadInput("--time: must be a finite number of seconds")
    pose = Pose(arguments.variant, arguments.animation, arguments.time or 0.0)
    folder = target.with_suffix(".assets")
    with (
        tempfile.TemporaryDirectory(prefix="sunbox-") as scratch,
        closing(AssetStore(Path(scratch), config, presets.builtin_assets)) as store,
        FileAssets(source.parent, asset_folders(arguments.asset_root), store) as beside,
        refusals(),
    ):
        model = import_model(source, data, store, beside, pose, arguments.entry)
        _tell_choices(model, pose)
        document = model.scene(presets.default_environment())
        if model.kind == "materials":
            document = {name: document[name] for name in ("materials", "textures")}
        if (aspect := model.aspect_ratio) not in (None, 1):
            size = picture_size(read_settings([], config), aspect)
            options = f"--set width={size['width']} --set height={size['height']}"
            print(
                f"note: the camera's picture is {aspect:.3g} times as wide as high: {options} renders it",
                file=sys.stderr,
            )
        builtin = presets.builtin_assets().keys()
        files.make_folder(folder)

        def written(id: str) -> str:
            """Write an asset under the name of its hash: importing again rewrites only what changed."""
            if id in builtin:
                return id
            name = f"{id.removeprefix('sha256:')[:16]}.{store.info(id).format}"
            # There may be thousands, and the model can be imported again
            files.write(folder / name, store.read(id), lasting=False)
            return f"{folder.name}/{name}"

        named = {ref: written(ref) for ref in references.references(document)}
        document = references.renamed(document, named.__getitem__)
    files.write(target, (json.dumps(document, indent=1) + "\n").encode())
    return 0


def _picture(source: Path, target: Path) -> int:
    """Write the document of a picture that Sunbox made. Files keep the names that they had."""
    from service.cli.documents import read_source
    from service.document import references

    made = read_source(source, (), configuration())
    document = references.renamed(made.document, lambda id: made.assets.get(id, id))
    files.write(target, (json.dumps(document, indent=1) + "\n").encode())
    return 0


def _tell_choices(model: Imported, pose: Pose) -> None:
    """The variants and animations that were not asked for, on stderr."""
    if model.variants and pose.variant is None:
        print(f"note: --variant NAME takes another variant: {', '.join(model.variants)}", file=sys.stderr)
    if model.animations and pose.animation is None:
        names = ", ".join(f"{each['name']} ({each['duration']:.3g} s)" for each in model.animations)
        print(f"note: --animation NAME --time S poses the model: {names}", file=sys.stderr)
