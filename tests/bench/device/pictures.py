"""Pictures beside those of llvmpipe, within the noise that several seeds show."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from gpu import Renderer
from service.bench.device import stage
from tests.bench.device import subjects
from tests.bench.device.part import Options, Row

SIDE, AREA = 96, 12  # pixels of a picture's side, and of an area's
SEEDS, SAMPLES = 8, 64
FINE = 4.5  # the worst difference of an area over its standard error, of some thousand areas of eight seeds


def areas(renderer: Renderer, name: str, seeds: int = SEEDS) -> tuple[np.ndarray, Row]:
    """Means over areas of `seeds` pictures, (seeds, rows, columns, 3), and what is wrong with them."""
    scene = renderer.load(subjects.arrays(name))
    out, bad, warned = [], 0, []
    for seed in range(seeds):
        picture = renderer.picture(scene, stage.settings((SIDE, SIDE), seed=seed))
        while picture.samples < SAMPLES:
            picture.trace(1.0, SAMPLES)
        color = picture.read()
        bad += int(np.count_nonzero(~np.isfinite(color)))
        warned = picture.warnings
        out.append(color[..., :3].reshape(SIDE // AREA, AREA, SIDE // AREA, AREA, 3).mean((1, 3)))
        picture.release()
    scene.release()
    return np.stack(out).astype(np.float32), {"bad": bad, "warnings": warned}


def rows(options: Options) -> Iterator[Row]:
    reference = np.load(options.reference) if Path(options.reference).exists() else {}
    names = subjects.NAMES if options.scale >= 1 else subjects.NAMES[:4]
    kept: dict[str, np.ndarray] = {}
    with Renderer(options.device) as renderer:
        for name in names:
            try:
                yield {"scene": name, **_beside(renderer, name, reference, kept)}
                np.savez_compressed(Path(options.folder, "pictures.npz"), **kept)  # type: ignore[arg-type]
            except Exception as error:  # of whatever kind: the other scenes go on
                yield {"scene": name, "failed": f"{type(error).__name__}: {error}"[:1000]}


def _beside(renderer: Renderer, name: str, reference: dict[str, np.ndarray], kept: dict[str, np.ndarray]) -> Row:
    began = time.perf_counter()
    ours, row = areas(renderer, name)
    kept[name] = ours
    row["took_s"] = round(time.perf_counter() - began, 2)
    if name in reference:
        row |= compared(ours, reference[name])
    return row


def compared(ours: np.ndarray, theirs: np.ndarray) -> Row:
    """`same` is the largest relative difference of an area with the same seed; `z` the worst difference of the means
    over its standard error; `ratio` that of the whole pictures."""
    n = min(len(ours), len(theirs))
    scale = float(np.abs(theirs).mean())
    same = float(np.abs(ours[:n] - theirs[:n]).max() / scale)
    error = np.sqrt((ours.var(0, ddof=1) + theirs.var(0, ddof=1)) / n) + 1e-4 * scale
    z = float((np.abs(ours.mean(0) - theirs.mean(0)) / error).max())
    return {"same": same, "ratio": float(ours.mean() / theirs.mean()), "z": z, "fine": z < FINE}


def write_reference(file: Path) -> None:
    """Render what other devices are compared with, by this one, which should be llvmpipe."""
    found = {}
    with Renderer() as renderer:
        for name in subjects.NAMES:
            found[name] = areas(renderer, name)[0]
            print(name, found[name].shape, float(found[name].mean()), flush=True)
    np.savez_compressed(file, **found)  # type: ignore[arg-type]
