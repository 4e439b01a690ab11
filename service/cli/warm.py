"""`sunbox warm [SCENE ...]`: compiles kernels before a server needs them, into the driver's cache."""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Iterator
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path
from typing import TYPE_CHECKING, Any

from service.cli import Failed, configuration
from service.cli.documents import pack_scene, read_source, source_assets
from service.config import cores
from service.document import presets

if TYPE_CHECKING:
    from service.config import Config
    from service.ipc.messages import Foresee, SceneData

SETTINGS = {"width": 16, "height": 16}  # a stream's kernel does not depend on its size


def run(arguments: argparse.Namespace) -> int:
    config = configuration()
    named = [_packed(Path(path), arguments.asset_root, config) for path in arguments.scenes]
    from gpu import GpuError
    from service.worker.foreseen import NotKept, wanted, warm

    began = time.monotonic()

    def on_progress(done: int, of: int) -> None:
        print(f"{done} of {of} kernels, {time.monotonic() - began:.0f} s", file=sys.stderr)

    keys = wanted(list(foreseen(named, config)))
    device = int(config.devices[0]) if config.devices and not config.software_renderers else config.device
    try:
        driver = warm(keys, device, config.software_renderers > 0, arguments.jobs or cores(), on_progress)
    except BrokenProcessPool:
        raise Failed("a process that compiles has ended; perhaps the machine's memory has run out") from None
    except NotKept:
        raise Failed("the driver keeps no kernels: its disk cache is off, or cannot be written") from None
    except (GpuError, OSError) as error:
        raise Failed(str(error)) from None
    print(f"{len(keys)} kernels are compiled for {driver}")
    return 0


def _packed(path: Path, roots: list[str], config: Config) -> SceneData:
    source = read_source(path, roots, config)
    with source_assets(source, roots, config) as assets:
        return pack_scene(source, assets, config).arrays


def foreseen(named: list[SceneData], config: Config) -> Iterator[Foresee]:
    """The scenes that are named, and all that a server foresees."""
    from service.ipc.messages import Foresee
    from service.server.assets import AssetStore
    from service.server.requests.request_reader import RequestReader

    reader = RequestReader(config, AssetStore(config.data_dir, None, presets.builtin_assets))
    settings = reader.settings(SETTINGS).for_gpu()

    def built_in(document: Any) -> SceneData:
        return reader.pack(reader.scene(document), owner="").arrays

    shown, edits, others = presets.likely()
    first = built_in(shown)
    for scene in (*named, first, *map(built_in, others)):
        yield Foresee(0, scene, settings)
    for scene in map(built_in, edits):
        yield Foresee(0, scene, settings, before=first)
