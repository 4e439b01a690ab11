"""A server and an editor: the first picture, then moves of a slider and of the camera."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

from service.bench import latency
from tests.bench.device.part import Options, Row

SIZES = ((512, 512), (1920, 1080))
MOVES = 12


def rows(options: Options) -> Iterator[Row]:
    variables = {} if options.device is None else {"SUNBOX_DEVICE": str(options.device)}
    with tempfile.TemporaryDirectory(prefix="sunbox-looks-") as folder:
        try:
            for turn in ("cold", "warm"):
                with latency.server(folder, **variables) as (port, began):
                    for size in SIZES if options.scale >= 1 else SIZES[:1]:
                        with latency.open_stream(port) as stream:
                            editor = latency.Editor(port, stream, latency.SCENE, size)
                            yield {"what": f"start, {turn}", "width": size[0],
                                   "ms": round(editor.start(began), 1)}  # fmt: skip
                            for hand, move in (("slider", editor.move), ("camera", editor.turn)):
                                taken, scales = [], []
                                for _ in range(MOVES):
                                    taken.append(move())
                                    scales.append(editor.scale)
                                taken.sort()
                                yield {
                                    "what": f"{hand}, {turn}",
                                    "width": size[0],
                                    "p50_ms": round(taken[MOVES // 2], 1),
                                    "worst_ms": round(taken[-1], 1),
                                    "scales": str(sorted(set(scales))),
                                }
                        began = time.perf_counter()
        finally:
            log = Path(folder, "server.log")
            if log.exists():
                text = log.read_text(errors="replace")
                kept = [line for line in text.splitlines() if '"level": "info"' not in line and "INFO" not in line]
                yield {"what": "log", "text": "\n".join(kept)[-3000:], "lines": text.count("\n")}
