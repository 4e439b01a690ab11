"""Resolving, reading back and encoding a picture."""

from __future__ import annotations

from functools import partial

from gpu import Renderer
from service.bench.device import stage
from service.bench.device.stage import Options, Row
from service.formats import images
from service.views import StreamFormat

SCENE, SAMPLES = "cornell-boxes", 4
FORMATS: tuple[StreamFormat, ...] = ("jpeg", "webp", "png")


def measure(options: Options) -> list[Row]:
    """A `report.Readout` for each size."""
    out = []
    with Renderer(options.device) as renderer:
        scene = renderer.load(stage.arrays(SCENE))
        for width, height in options.sizes:
            picture = renderer.picture(scene, stage.settings((width, height)))
            while picture.samples < SAMPLES:
                picture.trace(1.0, SAMPLES)
            pixels, turn_s = picture.display(), options.turn_s / 4
            row: Row = {
                "width": width,
                "height": height,
                "display_ms": stage.median_ms(picture.display, turn_s),
                "linear_ms": stage.median_ms(picture.read, turn_s),
            }
            row["encoded"] = [
                {
                    "format": name,
                    "ms": stage.median_ms(partial(images.encode, pixels, name), turn_s),
                    "bytes": len(images.encode(pixels, name)),
                }
                for name in FORMATS
            ]
            out.append(row)
            picture.release()
    return out
