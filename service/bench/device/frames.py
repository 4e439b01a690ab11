"""First frames after changes, at the socket of a real server."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager

from service.bench import latency
from service.bench.device import stage
from service.bench.device.stage import Options, Row

MOVES = 20  # of each kind in each size


def measure(size: tuple[int, int], options: Options) -> Row:
    """A `report.Frames`. Every scene is shown twice, and then the changes are made to the first one."""
    first, *others = options.scenes
    moves = max(2, min(MOVES, round(options.seconds / 10)))
    with tempfile.TemporaryDirectory(prefix="sunbox-bench-") as folder:
        with _editor(folder, size, options) as (editor, cold_ms):
            shown = [stage.percentiles([editor.show(name) for name in (*others, first)]) for _ in range(2)]
            material, camera = ([move() for _ in range(moves)] for move in (editor.move, editor.turn))
        with _editor(folder, size, options) as (_, warm_ms):
            pass
    return {
        "width": size[0],
        "height": size[1],
        "start_cold_ms": cold_ms,
        "start_warm_ms": warm_ms,
        "scene_first": shown[0],
        "scene_again": shown[1],
        "material": stage.percentiles(material),
        "camera": stage.percentiles(camera),
    }


@contextmanager
def _editor(folder: str, size: tuple[int, int], options: Options) -> Iterator[tuple[latency.Editor, float]]:
    """An editor that has shown its first image, at a server of its own with its caches in `folder`, and the
    milliseconds that this took."""
    variables = {} if options.device is None else {"SUNBOX_DEVICE": str(options.device)}
    with latency.server(folder, **variables) as (port, began), latency.open_stream(port) as stream:
        editor = latency.Editor(port, stream, options.scenes[0], size)
        yield editor, editor.start(began)
