"""The price list for people: Markdown, plots, and the short form that the service hands out."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from service.document.quality import PRESETS, PRICES_FILE, short, text

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
BEGIN, END = "<!-- presets: written by `sunbox bench tradeoff --publish` -->", "<!-- presets end -->"

Row = dict[str, Any]


def publish(document: Row) -> None:
    """Writes docs/tradeoff.json, .md and .png, the list that the service hands out, and the README's presets."""
    DOCS.mkdir(exist_ok=True)
    (DOCS / "tradeoff.json").write_text(json.dumps(document, separators=(",", ":")) + "\n")
    (DOCS / "tradeoff.md").write_text(markdown(document))
    plot(document, DOCS / "tradeoff.png")
    PRICES_FILE.write_text(json.dumps(prices(document), indent=1) + "\n")
    readme = ROOT / "README.md"
    before, _, rest = readme.read_text().partition(BEGIN)
    _, _, after = rest.partition(END)
    rows = [f"| {name} | {text(name, document)} |" for name in PRESETS]
    table = "\n".join(["| preset | what it takes and gives up |", "|---|---|", *rows])
    if after:
        readme.write_text(f"{before}{BEGIN}\n{table}\n{END}{after}")


def prices(document: Row) -> Row:
    """What `service/prices.json` holds: presets and knobs, with the machine that they were measured on."""
    kept = ("machine", "measured_size", "told_size", "flip", "presets", "knobs")
    return {name: document[name] for name in kept}


def markdown(document: Row) -> str:
    """Presets, knobs, and each scene's presets."""
    machine, size, ppd = document["machine"], document["told_size"], document["flip"]["pixels_per_degree"]
    lines = [
        "# The price list",
        "",
        f"Measured by `sunbox bench tradeoff` on {machine['processor']}, {machine['cores']} cores,",
        f"{machine['renderer']}, commit {machine['commit']}. Pictures of {document['measured_size']} pixels a side",
        f"against converged references; seconds are told for {size} x {size}. relMSE is",
        "mean((x - r)^2 / (r^2 + .01)); FLIP is that of the default view (pbr_neutral, exposure 0) at",
        f"{ppd:.0f} pixels per degree; bias is the root of the relMSE that more samples would not remove.",
        "On a software renderer seconds are processor time over cores.",
        "",
        "## Presets",
        "",
        "| | seconds | noise | relMSE | FLIP | light missing | at most | beaten by |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for name, p in document["presets"].items():
        worst = p["worst_missing_light"]
        lines.append(
            f"| {name} | {short(p['seconds'])} | {p['noise']:.1%} | {p['relmse']:.2g} | {p['flip']:.3f} |"
            f" {p['missing_light']:.2%} | {worst['share']:.1%} ({worst['scene']}) |"
            f" {'; '.join(p['beaten_by']) or 'nothing'} |"
        )
    lines += [
        "",
        "Seconds and relMSE are geometric means over the scenes, noise, FLIP and missing light their medians.",
        "A preset is beaten by what is 5 % faster and errs 5 % less.",
        "",
        "## Knobs",
        "",
        "Each turned alone from balanced. Time, error and FLIP are ratios to balanced at the same samples; at equal",
        f"time means in the time that balanced takes for {document['equal_samples']} samples.",
        "",
        "| knob | value | samples | time | relMSE | FLIP | relMSE at equal time | bias | worst bias | least light |",
        "|---|---|---|---|---|---|---|---|---|---|",
    ]
    for k in document["knobs"]:
        (bias, where), (light, dark) = k["worst_bias"], k["light"]  # with the scene
        lines.append(
            f"| {k['knob']} | {k['value']} | {k['samples']} | {k['time']:.2f} | {k['relmse']:.2f} | {k['flip']:.2f} |"
            f" {k['equal_time']:.2f} | {k['bias']:.3f} | {bias:.3f} ({where}) | {light:.1%} ({dark}) |"
        )
    lines += ["", "## Presets, scene by scene", ""]
    lines += ["| scene | preset | seconds | noise | relMSE | FLIP | light |", "|---|---|---|---|---|---|---|"]
    for scene in document["scenes"]:
        for name, p in scene["presets"].items():
            lines.append(
                f"| {scene['name']} | {name} | {short(p['seconds'])} | {p['noise']:.1%} | {p['relmse']:.2g} |"
                f" {p['flip']:.3f} | {p['light']:.1%} |"
            )
    return "\n".join([*lines, "", "![relMSE over seconds](tradeoff.png)", ""])


def plot(document: Row, path: Path) -> None:
    """relMSE over seconds, a panel for each scene: samples, denoised, half resolution, and the presets."""
    import matplotlib

    matplotlib.use("agg")
    from matplotlib import pyplot

    scenes = document["scenes"]
    figure, axes = pyplot.subplots(2, (len(scenes) + 1) // 2, figsize=(16, 8), squeeze=False, layout="constrained")
    shown = {("samples", "balanced"), ("denoise", "true"), ("resolution_scale", "0.5"), ("sampler", "independent")}
    for axis, scene in zip(axes.flat, scenes, strict=False):
        for row in scene["variations"]:
            if (row["knob"], row["value"]) in shown:
                points = [(p["seconds"], max(p["relmse"], 1e-7)) for p in row["curve"]]
                axis.loglog(*zip(*points, strict=True), "o-", label=f"{row['knob']} {row['value']}")
        for name in PRESETS:
            at = scene["presets"][name]["seconds"], max(scene["presets"][name]["relmse"], 1e-7)
            axis.loglog(*at, "k*")
            axis.annotate(name, at, textcoords="offset points", xytext=(4, 4))
        axis.set(title=scene["name"], xlabel="seconds at 512 x 512", ylabel="relMSE")
        axis.grid(True, which="major", alpha=0.3)
    for axis in axes.flat[len(scenes) :]:
        axis.axis("off")
    axes.flat[0].legend()
    figure.savefig(path, dpi=80, metadata={"Software": None})
    pyplot.close(figure)
