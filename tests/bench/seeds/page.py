"""The page about the experiments, as Markdown: their figures, and what the pictures show."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator, Sequence
from typing import Any

from tests.bench.seeds.spheres import NONE, OURS, SPLITS, UNORDERED

NAME = "experiments"  # the name of the page, and of the folder with its pictures
Row = dict[str, Any]

# Times of the earlier programs on two llvmpipe cores (Mesa 22.3.6). This command does not measure them.
EARLIER_FIELDS_MS = {100: 249, 1000: 699, 10_000: 1890}  # a path of each of 960 x 544 pixels
FIELD_PIXELS = 960 * 544
EARLIER_CUBEMAP_MS = {1: 343, 16: 921, 64: 2357, 256: 8814}  # at 800 x 800
EARLIER_MODEL_NS = (135_000, 277_000)  # a path: 1.9 to 3.9 s for each of 160 x 88 pixels


def markdown(document: Row) -> str:
    """The whole page."""
    about = document["machine"]
    lines = [
        "# Experiments",
        "",
        *_prose(
            "Sunbox grew out of three student programs: a renderer of one sphere with the `disney` model, a path"
            " tracer of spheres and boxes with a bounding volume hierarchy, and a comparison of reflection models."
            " Here are their experiments, repeated with Sunbox. `sunbox bench seeds --publish` measures everything"
            " and writes this page."
        ),
        *_prose(
            f"Measured on two llvmpipe cores ({about['processor']}; {about['renderer']}), in"
            f" {document['took_s'] / 60:.0f} minutes. A time is processor time over cores and the median of rounds in"
            " which everything that is compared has its turn. Other work ran on the machine meanwhile: ratios between"
            " the columns of one table are worth more than the times. Figures of the earlier programs, where they are"
            " known, were taken on two llvmpipe cores as well, in scenes that are similar but not the same."
        ),
    ]
    for part in (_fields, _rooms, _model, _samples, _blur, _reflection):
        lines += part(document)
    return "\n".join(lines)


def _fields(document: Row) -> Iterator[str]:
    rows = document["spheres"]
    scale = FIELD_PIXELS / (rows[0]["size"][0] * rows[0]["size"][1])
    first, last, most = rows[0]["ms"], rows[-1]["ms"], rows[-1]["spheres"]
    yield from _heading(
        "Fields of spheres", "spheres", "From left to right 100, 1 000 and 10 000 spheres, with up to 4 bounces."
    )
    yield from _prose(
        f"Without a tree every ray tries every sphere: {most:,} take {last[NONE] / first[NONE]:.0f} times as long as"
        f" {rows[0]['spheres']}. With Sunbox's tree it is {last[OURS] / first[OURS]:.1f} times. At {most:,} spheres"
        f" the tree is {last[NONE] / last[OURS]:.0f} times as fast as none."
    )
    yield from _prose("Milliseconds for one path of each of 960 x 544 pixels (measured on fewer pixels of the view):")
    table = []
    for row in rows:
        ms = [scale * row["ms"][name] for name in (NONE, UNORDERED, OURS)]
        earlier = _known(EARLIER_FIELDS_MS, row["spheres"])
        table.append([f"{row['spheres']:,}", *(f"{x:,.0f}" for x in ms), f"{ms[0] / ms[2]:.1f}", earlier])
    yield from _table(["spheres", "no tree", "one order", "Sunbox", "no tree / Sunbox", "earlier program"], table)
    yield from _prose(
        "*One order* is Sunbox's tree, walked by all rays in the order in which it was built. Sunbox keeps an order"
        " for each octant of directions, so that near boxes come first and hide those behind them:"
        f" {last[UNORDERED] / last[OURS] - 1:.0%} at {most:,} spheres."
    )
    yield from _prose("How boxes are divided while the tree is built. Time of tracing as a multiple of Sunbox's:")
    table = [
        [f"{row['spheres']:,}", *(f"{row['ms'][name] / row['ms'][OURS]:.2f}" for name in SPLITS)] for row in rows
    ]
    yield from _table(["spheres", *SPLITS], table)
    yield from _prose(
        f"Milliseconds of building the tree of {most:,} spheres and laying out its eight orders. Sunbox uses 16 bins"
        " for the surface area heuristic (SAH), and 8 where there are fewer than 24 boxes:"
    )
    yield from _table(list(SPLITS), [[f"{rows[-1]['build_ms'][name]:.1f}" for name in SPLITS]])
    yield from _picture("Time over the number of spheres", "plot-spheres")


def _rooms(document: Row) -> Iterator[str]:
    rows = document["rooms"]
    side = rows[0]["size"]
    yield from _heading(
        "Boxes, 1 to 4 bounces",
        "rooms",
        "From left to right 1 to 4 bounces. With one bounce there is direct light alone, so that ceilings are black."
        " The second brings the walls' colours to the boxes and light to the ceiling; the third and the fourth only"
        " brighten the corners. The metal wall of the third box shows a room that is one bounce behind. The open box"
        " needs no lamp: its light comes from the sky, the same from everywhere, and shadows lie in the corners.",
    )
    yield from _prose(f"Milliseconds for a path of each of {side} x {side} pixels:")
    table = [[row["room"], *(f"{ms:.0f}" for ms in row["ms"]), f"{row['ms'][3] / row['ms'][0]:.2f}"] for row in rows]
    yield from _table(["scene", "1", "2", "3", "4", "4 / 1"], table)
    yield from _prose(
        "The earlier program took 187 to 421 ms a path per pixel in its first box with 1 to 4 bounces, and 385 to"
        " 1 057 ms in its second: 2.3 and 2.7 times as long for four bounces as for one."
    )


def _model(document: Row) -> Iterator[str]:
    found = document["model"]
    ns = [1e6 * ms / found["size"] ** 2 for ms in found["ms"]]
    yield from _heading(
        f"A model of {found['triangles']:,} triangles, 0 to 4 bounces",
        "model",
        "From left to right 0 to 4 bounces. Without a bounce only what shines is seen, here the environment. Most of"
        " the light is there with the first; the second lights the shadow under the belly from the table.",
    )
    yield from _prose(f"A path of each of {found['size']} x {found['size']} pixels:")
    table = [["ms", *(f"{ms:.0f}" for ms in found["ms"])], ["ns a path", *(f"{x:,.0f}" for x in ns)]]
    yield from _table(["bounces", *map(str, range(5))], table)
    low, high = EARLIER_MODEL_NS
    yield from _prose(
        f"The earlier program took 1.9 to 3.9 s for a path of each of 160 x 88 pixels of a model of 7 050 triangles:"
        f" {low:,} to {high:,} ns a path, where Sunbox takes {ns[1]:,.0f} to {ns[-1]:,.0f}."
    )


def _samples(document: Row) -> Iterator[str]:
    found = document["samples"]
    size = found["size"]
    uniform, ours = found["cubemap"]
    yield from _heading(
        "A point light, and samples of a cubemap",
        "samples",
        "From left to right 1, 4, 16 ... 4 096 samples of a diffuse and of a metal ball under a sky with a small sun."
        " First and third row: uniform directions of the hemisphere. Second and fourth: Sunbox's choice, up to 1 024."
        " Uniform directions seldom meet the sun, so that the lit side is made of bright specks, and dark"
        " between them.",
    )
    yield from _picture("A metal ball in the light of a point, one sample", "point")
    yield from _prose(
        f"At {size} x {size} a sample takes {found['point_ms']:.0f} ms in the light of a point, where one is enough"
        " but for smooth edges. The earlier program took 251 ms, and 36 ms after its work groups were made 8 x 8"
        f" instead of 1 x 1. In the light of the cubemap, milliseconds for N samples of each of {size} x {size}"
        " pixels:"
    )
    counts = uniform["samples"]
    table = [
        [
            f"{n:,}",
            *(f"{way['ms'][i]:,.0f}" if i < len(way["ms"]) else "" for way in (uniform, ours)),
            _known(EARLIER_CUBEMAP_MS, n),
        ]
        for i, n in enumerate(counts)
    ]
    yield from _table(["N", "uniform", "Sunbox", "earlier program, uniform"], table)
    yield from _prose(
        "A sample of Sunbox looks for the light several times at the first surface, besides following the BSDF, and"
        " so costs more than one direction. Root mean square error over the mean, on smaller pictures (with few"
        " uniform samples hardly one has met the sun, and the error is still to grow):"
    )
    columns = [f"{row['material']}, {row['way']}" for row in found["errors"]]
    table = [
        [f"{n:,}", *(f"{row['error'][i]:.2g}" if i < len(row["error"]) else "" for row in found["errors"])]
        for i, n in enumerate(counts)
    ]
    yield from _table(["N", *columns], table)
    errors = {(row["material"], row["way"]): row["error"] for row in found["errors"]}
    at = min(map(len, errors.values())) - 1
    slower = uniform["ms"][at] / ours["ms"][at]
    for material in ("diffuse", "metal"):
        ratio = errors[material, "uniform"][at] / errors[material, "Sunbox"][at]
        yield from _prose(
            f"{material.capitalize()}: at {counts[at]:,} samples Sunbox's error is {ratio:.0f} times smaller. Uniform"
            f" directions would need about {ratio**2 * slower:,.0f} times Sunbox's time for it."
        )
    yield from _prose(
        "The root mean square errors of the earlier program, for a diffuse ball under a sky with a sun, of mean"
        " 0.433, were 27.6, 6.5, 3.2, 1.6 and 0.83 with 1, 16, 64, 256 and 1 024 samples."
    )


def _blur(document: Row) -> Iterator[str]:
    rows = document["blur"]
    said = ", ".join(f"{row['degrees']:g}" for row in rows)
    yield from _heading(
        "A blurred environment against noise",
        "blur",
        f"`environment.blur` of {said} degrees. Above: 16 uniform samples; below: converged. The specks go, and with"
        " them the edge of the shadow and the sun in the highlight.",
    )
    yield from _prose(
        "Noise is the root mean square error of 16 samples against the converged picture with the same blur; bias is"
        " that of the converged picture against the one without blur; the error is what both make together. All are"
        " over the mean."
    )
    ways = list(rows[0]["noise"])
    table = [
        [
            f"{row['degrees']:g}",
            *(f"{row['noise'][way]:.3f}" for way in ways),
            f"{row['bias']:.3f}",
            *(f"{row['error'][way]:.3f}" for way in ways),
            f"{row['pack_ms']:.0f}",
        ]
        for row in rows
    ]
    head = ["blur", *(f"noise, {way}" for way in ways), "bias", *(f"error, {way}" for way in ways), "packing, ms"]
    yield from _table(head, table)
    best = {way: min((row["error"][way], row["degrees"]) for row in rows)[1] for way in ways}
    verdicts = "; ".join(f"`{way}`: {degrees:g}" for way, degrees in best.items())
    yield from _prose(
        f"The blur that leaves the least error, in degrees: {verdicts}. Where the estimator looks for the sun by"
        " itself there is little noise to take away, and a blur only takes from the picture."
    )


def _reflection(document: Row) -> Iterator[str]:
    found = document["reflection"]
    names = found["models"]
    yield from _heading(
        "Reflection models",
        "reflection",
        f"Rows: {', '.join(f'`{name}`' for name in names)}. Columns: {', '.join(found['lights'])}. All are a red"
        " plastic with highlights of about one width, and in soft light they are hard to tell apart. Look at the"
        " third column, whose sun stands low behind the knot: there light grazes the surface, and the models with"
        " Fresnel's reflection and exact masking (`microfacet`, `principled`) have a bright edge that the older ones"
        " lack.",
    )
    side, base = found["size"], found["ms"]["principled"]
    yield from _prose(
        f"Milliseconds for a path of each of {side} x {side} pixels, and as multiples of `principled`. The time is"
        " the knot's, whose triangles rays have to find; the models differ by less than what was measured can tell:"
    )
    table = [[f"`{name}`", f"{found['ms'][name]:.0f}", f"{found['ms'][name] / base:.2f}"] for name in names]
    yield from _table(["model", "ms", "ratio"], table)
    angles = [f"{angle:g}°" for angle in found["angles"]]
    for what, said in (
        (
            "metal",
            "Energy: the share of the light from an angle that a white metal reflects. A perfect one reflects 1:",
        ),
        ("gloss", "Fresnel: the share that the surface of a black plastic reflects:"),
    ):
        yield from _prose(said)
        table = [[f"`{name}`", *(f"{x:.3f}" for x in found[what][name])] for name in names]
        yield from _table(["model", *angles], table)
    yield from _prose(
        "`principled` puts back what scatters more than once between microfacets, and stays at 1. Models of single"
        " scattering lose it. `blinn_phong` and its kin are normalised by nothing: their energy is what `specular`"
        " and the exponent make of it, and it falls towards the edge, where that of a real surface rises."
    )
    yield from _picture("Energy, Fresnel and highlights of the models", "plot-reflection")
    yield from _prose(
        "On the right is f of the metal in the plane of incidence, over its maximum, with the eye at 45 degrees. The"
        " powers of a cosine lie over each other in this plane, and so do the models of GGX: these have longer tails,"
        " which are the glow around lamps, and rise again towards the horizon."
    )


def _known(figures: dict[int, int], n: int) -> str:
    return f"{figures[n]:,}" if n in figures else ""


def _heading(title: str, picture: str, seen: str) -> Iterator[str]:
    yield from (f"## {title}", "")
    yield from _picture(title, picture)
    yield from _prose(seen)


def _picture(title: str, name: str) -> Iterator[str]:
    yield from (f"![{title}]({NAME}/{name}.webp)", "")


def _prose(text: str) -> list[str]:
    return [*textwrap.wrap(text, 120, break_long_words=False, break_on_hyphens=False), ""]


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    lines = [f"| {' | '.join(head)} |", "|" + "---|" * len(head)]
    return [*lines, *(f"| {' | '.join(row)} |" for row in rows), ""]
