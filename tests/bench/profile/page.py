"""Tables of a profile, and their section of llvmpipe.md."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from tests.bench.profile.hooks import ANY, EVENTS, KINDS, WHAT
from tests.bench.profile.knockouts import WHOLE
from tests.bench.profile.load_costs import ACTIVE

HERE = Path(__file__).parent
BEGIN, END = "<!-- profile: written by `python -m tests.bench profile --publish` -->", "<!-- profile end -->"
BY_KIND = ("ray", "box", "shape", "leaves")  # events of which each kind of ray has its own

Document = dict[str, Any]


def publish(document: Document, folder: Path = HERE) -> None:
    """Writes llvmpipe.json and the section of llvmpipe.md. Scenes and drivers that the document lacks stay as
    they were published before."""
    figures, page = folder / "llvmpipe.json", folder / "llvmpipe.md"
    before = json.loads(figures.read_text()) if figures.exists() else {}
    whole = {**before, **document, "scenes": before.get("scenes", {}) | document["scenes"]}
    text = page.read_text() if page.exists() else ""
    start, _, rest = text.partition(BEGIN)
    _, _, after = rest.partition(END)
    parts = [start.strip(), f"{BEGIN}\n{section(whole)}\n{END}", after.strip()]
    page.write_text("\n\n".join(filter(None, parts)) + "\n")
    figures.write_text(json.dumps(whole, separators=(",", ":")) + "\n")


def section(document: Document) -> str:
    """Everything that was measured, in Markdown."""
    about, scenes = document["machine"], document["scenes"]
    lines = [
        "## Figures",
        "",
        f"Measured by `python -m tests.bench profile` on {about['processor']}, {about['cores']} cores,",
        f"{about['renderer']}. Pictures of {document['size']} x {document['size']} pixels, 8 bounces where nothing",
        "else is said. Times are processor time of one core: medians of turns, in which all parts of a scene take",
        f"their turn under the same load. Load average at the end: {document['load']:.1f}.",
        "",
    ]
    if "loads" in document:
        lines += ["### Loads", "", *loads_table(document["loads"], document["machine"]["driver"]), ""]
    for name, scene in scenes.items():
        lines += [f"### {name}", "", f"Commit {_short(scene['commit'])}.", ""]
        lines += [*parts_table(scene), "", *counts_table(scene), "", *loops_table(scene), ""]
    if "drivers" in document:
        lines += drivers_table(document["drivers"])
    return "\n".join(lines).rstrip() + "\n"


def parts_table(scene: Document) -> list[str]:
    """What is left of a path's time without one of its parts."""
    rows = scene["parts"]
    whole = rows[0]["path_ns"]
    out = ["| | ns a path | of the whole | rays a path | ns a ray |", "|---|---|---|---|---|"]
    for row in rows:
        rays = row["counts"]["a_path"][ANY]["ray"]
        ns = row["path_ns"]
        out.append(f"| {row['name']} | {ns:,.0f} | {ns / whole:.2f} | {rays:.2f} | {ns / rays:,.0f} |")
    return out


def counts_table(scene: Document) -> list[str]:
    """How often a loop turns in a path, and the share of a vector's lanes that take part in it."""
    counts = next(row for row in scene["parts"] if row["name"] == WHOLE)["counts"]
    out = [
        "| in a path | " + " | ".join(f"{kind} | lanes in use" for kind in KINDS) + " |",
        "|---" * (1 + 2 * len(KINDS)) + "|",
    ]
    for event in EVENTS:
        cells = []
        for kind in KINDS:
            known = event in counts["a_path"][kind] and (kind == ANY or event in BY_KIND)
            often, used = (counts[key][kind][event] if known else 0.0 for key in ("a_path", "used"))
            cells += [f"{often:.2f}", f"{used:.0%}"] if known else ["", ""]
        if any(cells):
            out.append(f"| {WHAT[event]} | " + " | ".join(cells) + " |")
    return out


def loops_table(scene: Document) -> list[str]:
    """The loops of the machine code in its order; inner ones are set in."""
    if scene["loops"] is None:
        return [f"The machine code was not sampled: {scene['not_sampled']}."]
    out = ["| loop | time | instructions | of 8 lanes | gathers | on the stack |", "|---|---|---|---|---|---|"]
    for number, loop in enumerate(scene["loops"], 1):
        where = "· " * loop["depth"] + str(number)
        cells = [f"{loop['share']:.1%}", *(f"{loop[key]:,}" for key in ("instructions", "wide", "gathers", "stack"))]
        out.append(f"| {where} | " + " | ".join(cells) + " |")
    return out


def drivers_table(document: Document) -> list[str]:
    """Two versions of Mesa side by side."""
    out = [
        "### Another Mesa",
        "",
        f"{document['renderer']}, beside the one above, in turns; commit {_short(document['commit'])}.",
        "",
        *loads_table(document["loads"], document["renderer"]),
        "",
        "| scene | bounces | ns a path | other Mesa | ratio |",
        "|---|---|---|---|---|",
    ]
    for row in document["rows"]:
        figures = f"{row['path_ns']:,.0f} | {row['other_path_ns']:,.0f} | {row['ratio']:.2f}"
        out.append(f"| {row['name']} | {row['max_bounces']} | {figures} |")
    return out


def loads_table(loads: dict[str, list[float]], driver: str) -> list[str]:
    """What loads cost."""
    return [
        f"Nanoseconds for a turn of a loop in which lanes load 16 bytes, each from another place ({driver}):",
        "",
        "| lanes that load | " + " | ".join(map(str, ACTIVE)) + " |",
        "|---" * (1 + len(ACTIVE)) + "|",
        *(f"| {kind} | " + " | ".join(f"{ns:.1f}" for ns in row) + " |" for kind, row in loads.items()),
    ]


def _short(commit: str | None) -> str:
    return f"`{commit[:10]}{'+' * commit.endswith('+')}`" if commit else "unknown"
