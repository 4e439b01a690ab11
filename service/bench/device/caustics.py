"""Caustics traced from the lights beside those that the camera's paths find: what a sample costs of each."""

from __future__ import annotations

from gpu import LIGHT_PERIOD, Renderer
from service.bench.device import stage
from service.bench.device.stage import Options, Row

SCENES = ("pool", "whisky", "prism")
WAYS = ("light", "paths")


def measure(name: str, options: Options) -> Row:
    """A `report.Caustics` in the smallest size. Paths from the lights are traced in two of every LIGHT_PERIOD
    samples, so that whole periods are timed."""
    with Renderer(options.device) as renderer:
        scene = renderer.load(stage.arrays(name))
        pictures = {way: renderer.picture(scene, stage.settings(options.sizes[0], caustics=way)) for way in WAYS}
        rates = stage.rates(pictures, options.turn_s, LIGHT_PERIOD)
        for picture in pictures.values():
            picture.release()
    return {"scene": name, **rates}
