"""What `sunbox bench scale` found: tables, a figure, and their section of docs/scaling.md."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from service.worker.division.home import EACH
from service.worker.division.ledger import AHEAD_BYTES, LEASE_S, MOST_BYTES, PIXEL_BYTES
from tests.bench.scale_model import BLOCK

DOCS = Path(__file__).parents[2] / "docs"
BEGIN, END = "<!-- scale: written by `sunbox bench scale --publish` -->", "<!-- scale end -->"

Document = dict[str, Any]


def measured_table(document: Document) -> str:
    """A line for each server, in Markdown; ratios to the first."""
    rows = document["rows"]
    queue, large = document["queue"], document["large"]
    out = [
        f"| | renders/s, {_size(queue)} | | one render, {_size(large)} | |",
        "|---|---|---|---|---|",
    ]
    for row in rows:
        gains = row["renders_per_s"] / rows[0]["renders_per_s"], rows[0]["large_s"] / row["large_s"]
        out.append(
            f"| {row['name']} | {row['renders_per_s']:.2f} | {gains[0]:.2f} x |"
            f" {row['large_s']:.1f} s | {gains[1]:.2f} x |"
        )
    return "\n".join(out)


def _size(settings: Document) -> str:
    return f"{settings['width']} x {settings['height']}, {settings['max_samples']} samples"


def costs_table(document: Document) -> str:
    """What the simulation was fed with, in Markdown."""
    out = [
        "| scene | a block of a pixel | writing a result | merging |",
        "|---|---|---|---|",
    ]
    for scene, cost in document["costs"].items():
        block, write, merge = (1e6 * s for s in (BLOCK * cost["sample_s"], cost["write_s"], cost["merge_s"]))
        out.append(f"| {scene} | {block:.1f} µs | {write:.3f} µs | {merge:.3f} µs |")
    return "\n".join(out)


def speedup_table(document: Document) -> str:
    """Simulated speed-ups, the closed form behind each, and the part that comes to its limit first, in Markdown."""
    counts = document["renderers"]
    shown = [n for n in (8, 16, 32, 64) if n in counts] or counts
    head = " | ".join(f"{n}" for n in shown)
    out = [f"| scene | link | {head} | first limit |", "|---|---|" + "---|" * (len(shown) + 1)]
    for curve in document["curves"]:
        name = curve["scene"] + ("" if curve["faster"] == 1 else f", renderers {curve['faster']} times as fast")
        both = zip(counts, curve["speedup"], curve["closed_form"], strict=True)
        cells = [f"{got:.1f} ({closed:.1f})" for n, got, closed in both if n in shown]
        part, most = min(curve["limits"].items(), key=lambda item: item[1])
        out.append(f"| {name} | {curve['link']} | {' | '.join(cells)} | {part}, at {most:.{int(most < 10)}f} |")
    return "\n".join(out)


def figure(document: Document, path: Path) -> None:
    """Speed-up over the number of renderers. Raises ImportError without matplotlib."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    speeds = sorted({curve["faster"] for curve in document["curves"]})
    links = list(dict.fromkeys(curve["link"] for curve in document["curves"]))
    sheet = Figure(figsize=(4 * len(links), 3.6 * len(speeds)), layout="constrained")
    FigureCanvasAgg(sheet)
    counts = document["renderers"]
    for row, faster in enumerate(speeds):
        for column, link in enumerate(links):
            plot = sheet.add_subplot(len(speeds), len(links), row * len(links) + column + 1)
            for curve in document["curves"]:
                if (curve["faster"], curve["link"]) == (faster, link):
                    (line,) = plot.loglog(counts, curve["speedup"], "o-", markersize=3, label=curve["scene"])
                    plot.loglog(counts, curve["closed_form"], ":", color=line.get_color())
            plot.loglog(counts, counts, color="grey", linewidth=0.8)
            plot.set_title(("measured speed" if faster == 1 else f"{faster} times as fast") + f", {link}")
            plot.set_xlabel("renderers")
            plot.set_ylabel("speed-up")
            plot.grid(True, which="major", alpha=0.3)
            plot.legend(fontsize="small")
    sheet.savefig(path, dpi=110)


def publish(measured: Document, simulated: Document) -> None:
    """Write docs/scaling.json and .png, and the section of docs/scaling.md. Raises ImportError without matplotlib."""
    figure(simulated, DOCS / "scaling.png")
    figures = {"measured": measured, "simulated": simulated}
    (DOCS / "scaling.json").write_text(json.dumps(figures, separators=(",", ":")) + "\n")
    page = DOCS / "scaling.md"
    before, _, rest = page.read_text().partition(BEGIN)
    _, _, after = rest.partition(END)
    parts = [before.strip(), f"{BEGIN}\n{section(measured, simulated)}\n{END}", after.strip()]
    page.write_text("\n\n".join(filter(None, parts)) + "\n")


def section(measured: Document, simulated: Document) -> str:
    """The section of docs/scaling.md: what was measured, the model, and what it says."""
    about, work, costs = measured["machine"], simulated["work"], simulated["costs"]
    scene, cost = next(iter(costs.items()))
    size = f"{work['width']} x {work['height']}"
    link_us = 1e6 * PIXEL_BYTES / (1e9 / 8)
    block_us = 1e6 * BLOCK * cost["sample_s"]
    calm = (
        "Nothing else ran."
        if measured["load"] < 0.5
        else (f"Other programs ran at the same time (a load of {measured['load']:.1f}): even the ratios are rough.")
    )
    runs = len(measured["rows"][0]["runs"])
    ahead = AHEAD_BYTES / PIXEL_BYTES / (work["width"] * work["height"])
    forwarding_ms = 1e3 * simulated["forwarding_s"]
    return f"""## What more renderers gain

Measured by `sunbox bench scale --simulate` on {about["processor"]}, {about["cores"]} cores, {about["renderer"]},
commit {about["commit"]}.

### On one machine

A real server, with as many cores as its renderers have, for all of its processes. The queue has more renders
than renderers; the large render is divided. Medians of {runs} runs in turns.
{calm}

{measured_table(measured)}

### With more renderers than this machine has

No machine with many renderers was at hand. A simulation, event by event, runs the ledger that homes run (the
same code), with costs that were measured for a renderer with one core:

{costs_table(simulated)}

Assumptions:

- The render is {size} pixels with {work["samples"]:,} samples, and has all renderers to itself. They are
  equally fast, and so are all pixels of a scene.
- A result is a band of rows of a block, at most {MOST_BYTES / 1e6:.0f} MB, {PIXEL_BYTES} bytes a pixel, or
  {LEASE_S:g} s of tracing. An assistant has {EACH} leases at a time.
- Each renderer is on a host of its own with one link; the front door, too. A result goes over the assistant's
  link into the front door, out of it, and into the home. One way takes {1e3 * simulated["latency_s"]:g} ms.
- The front door takes a result from one socket and hands it to another in {forwarding_ms:.2f} ms (measured for
  {MOST_BYTES / 1e6:.0f} MB, without Ray).
- The home writes results, merges blocks in ascending order, traces the noise meter's {cost["meter_pixels"]:,}
  pixels in each block by itself, and traces bands in the time that is left.
- A renderer that is "100 times as fast" traces and merges in a hundredth of the time, and writes a result in
  the same time.

On paper: let c be the time of a sample of a pixel, w that of writing a pixel's result, m that of ending a block
(merging, and the meter) for each pixel, B the rate of a link in bytes/s, f the time in which the front door
hands on a byte. One renderer takes 64 c + m for a block of a pixel. With n of them the home's time and that of
the others add up to

    n T = 64 c + m + w (n - 1) T / (64 c),    so    speed-up = n - (n - 1) w / (64 c),

until one part has no time left: the home at (64 c + m) / (w + m), the links of the front door and of the home
at (64 c + m) B / 48, the front door at (64 c + m) / (48 f). For {scene} 64 c is {block_us:.1f} µs, and 48 bytes
take {link_us:.2f} µs on a link of 1 Gbit/s, which is then full with about {block_us / link_us:.0f} renderers.

A render begins more slowly: the home traces the first 8 samples alone. Meanwhile the others trace ahead, until
results of {AHEAD_BYTES >> 20} MiB wait at the home: {ahead:.1f} blocks of such a picture. So with S samples

    speed-up = S / (8 + (S - 8 - min(64 * {ahead:.1f}, 8 (n - 1))) / speed-up in the middle),

which the table has in parentheses behind what the simulation gave. What the simulation lacks to it is the end,
when the last bands are out. Where links or the front door are full below 1, a divided render takes longer than
one renderer would: the home waits for results that it could trace itself.

{speedup_table(simulated)}

![speed-up over renderers](scaling.png)

Dotted: the closed form, which leaves out what the home traces itself while a link is full; grey: as many times as
fast as there are renderers. The figures are in [scaling.json](scaling.json)."""
