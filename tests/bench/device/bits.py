"""Whether a picture has the same bits however its work was cut: by length of dispatches, by saving, by process."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator

from gpu import Picture, Renderer
from gpu.analysis.slices import slices_of
from service.bench.device import stage
from service.bench.device.isolated import SPAWN
from tests.bench.device import subjects
from tests.bench.device.part import Options, Row

SCENES = ("cornell-boxes", "sphere-field", "shader-ball: glass", "pool")
SIZE, SAMPLES = (96, 96), 300


def rows(options: Options) -> Iterator[Row]:
    samples = SAMPLES if options.scale >= 1 else 72
    for name in SCENES if options.scale >= 1 else SCENES[:2]:
        found = hashes(name, samples, options.device)
        with SPAWN.Pool(1) as pool:
            found["another process"] = pool.apply(hashes, (name, samples, options.device, True))["15 ms"]
        yield {"scene": name, "hashes": found, "fine": len(set(found.values())) == 1}


def hashes(name: str, samples: int, device: int | None, one: bool = False) -> dict[str, str]:
    """A hash of the picture's bits by the way it was made; with `one`, of one way alone."""
    out = {}
    arrays = subjects.arrays(name)
    with Renderer(device) as renderer:
        scene = renderer.load(arrays)
        for way, seconds in (("15 ms", 0.015), ("1 ms", 0.001), ("1 s", 1.0)):
            with slices_of(seconds):
                picture = renderer.picture(scene, stage.settings(SIZE))
                _trace(picture, samples)
                out[way] = _hash(picture)
                picture.release()
            if one:
                return out
        picture = renderer.picture(scene, stage.settings(SIZE))
        _trace(picture, samples // 3)
        picture.trace(0.0, samples)
        steps = picture.save()
        while True:
            try:
                next(steps)
            except StopIteration as ended:
                saved = ended.value
                break
        picture.release()
        picture = renderer.picture(scene, stage.settings(SIZE))
        picture.restore(saved)
        _trace(picture, samples)
        out["saved and restored"] = _hash(picture)
        picture.release()
    return out


def _trace(picture: Picture, samples: int) -> None:
    while picture.samples < samples:
        picture.trace(1.0, samples)


def _hash(picture: Picture) -> str:
    return hashlib.sha256(picture.read().tobytes()).hexdigest()[:12]
