"""Sunbox's side of `peers`: `python -m tests.bench.peer_sunbox JOB.json OUT.npz`, in a process of its own."""

from __future__ import annotations

import json
import sys
import time

import numpy as np

from gpu import Renderer, RenderSettings
from service.bench.scenes import BenchAssets
from service.document import parse_scene
from service.pack import pack
from tests.bench import peer_scenes

MANY = 1 << 24


def main() -> None:
    with open(sys.argv[1]) as file:
        job = json.load(file)
    (case,) = (c for c in peer_scenes.cases() if c.name == job["case"])
    size, moments = job["size"], list(job["moments"])
    settings = RenderSettings(size, size, case.max_bounces, filter="box", seed=job["seed"])
    with Renderer() as renderer:
        scene = renderer.load(pack(parse_scene(case.scene), BenchAssets()).arrays)
        picture = renderer.picture(scene, settings)
        picture.trace(0.2, 4)
        picture.reset()
        spent, seconds, counts, pictures = 0.0, [], [], []
        while moments:
            # A pass begun is a pass finished: only whole samples are a picture.
            began, samples = time.perf_counter(), picture.samples
            while picture.samples == samples:
                picture.trace(0.0, MANY)
            spent += time.perf_counter() - began
            while moments and spent >= moments[0]:
                moments.pop(0)
                seconds.append(spent)
                counts.append(picture.samples)
                pictures.append(picture.read()[..., :3])
    np.savez(sys.argv[2], seconds=seconds, samples=counts, pictures=pictures)


main()
