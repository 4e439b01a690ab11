"""From measured curves to prices: error at equal time, what each knob and preset costs, who is on the front."""

from __future__ import annotations

from typing import Any

import numpy as np

Row = dict[str, Any]
TINY = 1e-12  # an error that the reference cannot tell from none


def at_equal_time(rows: list[Row], samples: int) -> list[Row]:
    """The relMSE of each variation after the time in which the plain render takes that many samples, and its ratio to
    the plain render's."""
    plain = rows[0]["curve"]
    time = next(point["seconds"] for point in plain if point["samples"] == samples)
    own = interpolated(plain, time)
    return [
        {"knob": row["knob"], "value": row["value"], "relmse": found, "ratio": found / own}
        for row in rows
        for found in [interpolated(row["curve"], time)]
    ]


def interpolated(curve: list[Row], seconds: float) -> float:
    """relMSE at that time, straight in the logarithms of both; beyond the ends as at the nearest two points."""
    x = np.log([point["seconds"] for point in curve])
    y = np.log([max(point["relmse"], TINY) for point in curve])
    k = int(np.clip(np.searchsorted(x, np.log(seconds)), 1, len(x) - 1))
    slope = (y[k] - y[k - 1]) / (x[k] - x[k - 1])
    return float(np.exp(y[k - 1] + slope * (np.log(seconds) - x[k - 1])))


def summary(scenes: list[Row]) -> dict[str, Any]:
    """Knobs and presets over all scenes: geometric means."""
    knobs = []
    for k, row in enumerate(scenes[0]["variations"]):
        curves = [scene["variations"][k]["curve"] for scene in scenes]
        counts = [curve[-1]["samples"] for curve in curves]
        plain = [_at(scene["variations"][0]["curve"], n) for scene, n in zip(scenes, counts, strict=True)]
        last = [curve[-1] for curve in curves]
        knobs.append(
            {
                "knob": row["knob"],
                "value": row["value"],
                "samples": last[0]["samples"],
                "time": _mean(a["seconds"] / b["seconds"] for a, b in zip(last, plain, strict=True)),
                "relmse": _mean(a["relmse"] / max(b["relmse"], TINY) for a, b in zip(last, plain, strict=True)),
                "flip": _mean(a["flip"] / max(b["flip"], TINY) for a, b in zip(last, plain, strict=True)),
                "equal_time": _mean(scene["equal_time"][k]["ratio"] for scene in scenes),
                "bias": float(np.median([np.sqrt(point["bias"]) for point in last])),
                "worst_bias": max((float(np.sqrt(p["bias"])), s["name"]) for p, s in zip(last, scenes, strict=True)),
                "light": min((float(p["light"]), s["name"]) for p, s in zip(last, scenes, strict=True)),
            }
        )
    return {"knobs": knobs, "presets": presets(scenes)}


def presets(scenes: list[Row]) -> dict[str, Any]:
    """What each preset costs and gives up, and whether anything measured is both faster and better."""
    points = {name: _point([scene["presets"][name] for scene in scenes]) for name in scenes[0]["presets"]}
    others = {
        f"{row['knob']} {row['value']}, {row['curve'][i]['samples']} samples": _point(
            [scene["variations"][k]["curve"][i] for scene in scenes]
        )
        for k, row in enumerate(scenes[0]["variations"])
        if row["knob"] in ("samples", "max_bounces", "roulette_depth")
        for i in range(len(row["curve"]))
    }
    out = {}
    for name, (seconds, relmse) in points.items():
        own = [scene["presets"][name] for scene in scenes]
        better = [other for other, (t, e) in (others | points).items() if t < 0.95 * seconds and e < 0.95 * relmse]
        missing = [(max(0.0, 1 - float(p["light"])), s["name"]) for p, s in zip(own, scenes, strict=True)]
        out[name] = {
            "seconds": seconds,
            "relmse": relmse,
            "noise": float(np.median([p["noise"] for p in own])),
            "flip": float(np.median([p["flip"] for p in own])),
            "missing_light": float(np.median([m for m, _ in missing])),
            "worst_missing_light": dict(zip(("share", "scene"), max(missing), strict=True)),
            "beaten_by": sorted(better),
        }
    return out


def _at(curve: list[Row], samples: int) -> Row:
    return min(curve, key=lambda point: abs(point["samples"] - samples))


def _point(measured: list[Row]) -> tuple[float, float]:
    return _mean(p["seconds"] for p in measured), _mean(max(p["relmse"], TINY) for p in measured)


def _mean(values: Any) -> float:
    """Geometric: no scene counts more for being dim or slow."""
    return float(np.exp(np.mean(np.log([max(value, TINY) for value in values]))))
