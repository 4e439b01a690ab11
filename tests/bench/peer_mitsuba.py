"""Mitsuba's side of `peers`: a script for an interpreter that has `mitsuba`, which is no dependency of ours.

`python peer_mitsuba.py JOB.json OUT.npz`: renders the scene again and again with fresh seeds, and keeps the mean
picture at each of the job's moments, with the seconds that rendering took by then.
"""

from __future__ import annotations

import json
import sys
import time
from typing import Any

import numpy as np

SEEDS = 1 << 20  # of one run's passes: a reference that shared them would hide a run's error from itself


def main() -> None:
    import mitsuba as mi  # type: ignore[import-not-found]

    with open(sys.argv[1]) as file:
        job = json.load(file)
    mi.set_variant(job["variant"])
    arrays = np.load(job["arrays"]) if job["arrays"] else {}
    scene = mi.load_dict(_made(mi, job["scene"], arrays))
    moments, pass_spp = list(job["moments"]), 1
    seed = job["seed"] * SEEDS
    for _ in range(2):  # compiles
        seed += 1
        mi.render(scene, spp=1, seed=seed).numpy()
    total, spp, spent = np.zeros(0), 0, 0.0
    seconds, counts, pictures = [], [], []
    while moments:
        seed += 1
        began = time.perf_counter()
        picture = mi.render(scene, spp=pass_spp, seed=seed).numpy()[..., :3].astype(np.float64)
        took = time.perf_counter() - began
        spent += took
        total = total + pass_spp * picture if spp else pass_spp * picture
        spp += pass_spp
        while moments and spent >= moments[0]:
            moments.pop(0)
            seconds.append(spent)
            counts.append(spp)
            pictures.append((total / spp).astype(np.float32))
        if took < 0.25:
            pass_spp = min(2 * pass_spp, 64)
    np.savez(sys.argv[2], seconds=seconds, samples=counts, pictures=pictures)


def _made(mi: Any, node: Any, arrays: Any) -> Any:
    """The plain description with what JSON cannot hold put in: transforms, bitmaps, meshes."""
    if not isinstance(node, dict):
        return node
    if "matrix" in node:
        return mi.ScalarTransform4f(np.array(node["matrix"], float).reshape(4, 4))
    if node.get("type") == "arrays":
        return _mesh(mi, arrays, _made(mi, node["bsdf"], arrays))
    out = {key: _made(mi, value, arrays) for key, value in node.items() if key != "bitmap_array"}
    if "bitmap_array" in node:
        out["bitmap"] = mi.Bitmap(np.ascontiguousarray(arrays[node["bitmap_array"]]))
    return out


def _mesh(mi: Any, arrays: Any, bsdf: Any) -> Any:
    properties = mi.Properties()
    properties["bsdf"] = mi.load_dict(bsdf)
    vertices, faces, normals = arrays["vertices"], arrays["faces"], arrays["normals"]
    mesh = mi.Mesh("mesh", len(vertices), len(faces), has_vertex_normals=True, props=properties)
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = vertices.astype(np.float32).ravel()
    parameters["vertex_normals"] = normals.astype(np.float32).ravel()
    parameters["faces"] = faces.astype(np.uint32).ravel()
    parameters.update()
    return mesh


main()
