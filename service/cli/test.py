"""`sunbox test`: the scenes of a folder beside those of another, as a test of how they look."""

from __future__ import annotations

import argparse
import io
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree

from service.cli import BadInput, Failed, comparing, files
from service.cli.api import lines_of, server_or_local
from service.cli.comparing import Input

if TYPE_CHECKING:
    from PIL import Image

    from service.config import Config
    from sunbox import Client, Verdict

ENDINGS = (".exr", ".json")  # a scene goes before a picture of the same name
WIDEST = 256  # pixels of a picture on the sheet
MOST_ROWS = 64  # on the sheet: of pictures of 256 x 256 that is 17 000 pixels high


@dataclass
class Case:
    """A name with its two documents, and what became of it."""

    name: str
    sides: tuple[Input, Input] | None = None  # of the reference, and of what is tested
    only_in: str = ""  # the folder that alone has it
    settings: Sequence[dict[str, Any]] = ()
    verdict: Verdict | None = None
    seconds: float = 0.0

    @property
    def failure(self) -> str | None:
        """Why it fails; None where it does not."""
        if self.only_in:
            return f"is in {self.only_in} only"
        return comparing.said(self.verdict) if self.verdict is not None and self.verdict.different else None


def run(arguments: argparse.Namespace) -> int:
    from service.cli import configuration

    comparing.check_confidence(arguments)
    sheet, report = (
        None if each is None else files.writable(Path(each)) for each in (arguments.output, arguments.junit)
    )
    if sheet is not None and sheet.suffix.lower() != ".png":
        raise BadInput(f"-o {arguments.output!r}: must end in .png")
    cases = _cases(arguments, configuration())
    rows: dict[str, list[Image.Image]] = {}
    error = None
    try:
        with server_or_local(arguments.server) as client:
            for case in cases:
                _compare(client, case, arguments)
                if (
                    sheet is not None
                    and case.verdict is not None
                    and case.verdict.different
                    and len(rows) < MOST_ROWS
                ):
                    rows[case.name] = _pictures(client, case, arguments)
    except Failed as failed:
        error = comparing.could_not(failed)
    if report is not None:
        files.write(report, _junit(arguments.folder, cases, error))
    if sheet is not None and rows:
        files.write(sheet, _sheet(rows))
    if error is not None:
        raise error
    count = sum(case.failure is not None for case in cases)
    print(f"{len(cases)} compared, {count or 'none'} failed")
    return comparing.DIFFERENT if count else comparing.SAME


def _cases(arguments: argparse.Namespace, config: Config) -> list[Case]:
    """All documents are read, and mistakes named, before one is rendered. Raises BadInput."""
    of_a, of_b = _documents(arguments.against), _documents(arguments.folder)
    if not of_a and not of_b:
        raise BadInput(f"{arguments.folder!r} and {arguments.against!r}: hold no .json and no .exr file")
    return [_case(name, of_a.get(name), of_b.get(name), arguments, config) for name in sorted(of_a | of_b)]


def _case(name: str, of_a: Path | None, of_b: Path | None, arguments: argparse.Namespace, config: Config) -> Case:
    if of_a is None or of_b is None:
        return Case(name, only_in=arguments.folder if of_a is None else arguments.against)
    a, b = _read(of_a, arguments, config), _read(of_b, arguments, config)
    return Case(name, (a, b), settings=comparing.chosen(a, b, arguments, config))


def _read(path: Path, arguments: argparse.Namespace, config: Config) -> Input:
    """Raises BadInput, whose lines name the file."""
    try:
        return comparing.read_input(str(path), arguments, config)
    except BadInput as error:
        raise BadInput(*(line if str(path) in line else f"{path}: {line}" for line in error.lines)) from None


def _documents(folder: str) -> dict[str, Path]:
    """The files of a folder and the folders in it by their name without the ending. Raises BadInput."""
    if not Path(folder).is_dir():
        raise BadInput(f"{folder!r}: is not a folder")
    found = dict[str, Path]()
    for ending in ENDINGS:
        for path in sorted(Path(folder).rglob(f"*{ending}")):
            found[path.relative_to(folder).with_suffix("").as_posix()] = path
    return found


def _compare(client: Client, case: Case, arguments: argparse.Namespace) -> None:
    from sunbox import Refused

    if case.sides is not None:
        began = time.monotonic()
        try:
            case.verdict = comparing.verdict(client, *case.sides, case.settings, arguments)
        except Refused as error:
            raise BadInput(*(f"{case.name}: {line}" for line in lines_of(error))) from None
        case.seconds = time.monotonic() - began
    print(f"{case.name}: {case.failure or comparing.said(_known(case))}", flush=True)


def _known(case: Case) -> Verdict:
    assert case.verdict is not None
    return case.verdict


def _pictures(client: Client, case: Case, arguments: argparse.Namespace) -> list[Image.Image]:
    """Both sides as a screen shows them, and the map."""
    from PIL import Image

    found, sides = _known(case), case.sides
    assert sides is not None and found.map is not None
    samples = found.samples["a"], found.samples["b"]
    shown = [
        comparing.displayed(client, one, {**given, "max_samples": count}, arguments)
        for one, given, count in zip(sides, case.settings, samples, strict=True)
    ]
    return [_small(Image.open(io.BytesIO(data)).convert("RGB")) for data in (*shown, found.map)]


def _small(picture: Image.Image) -> Image.Image:
    if picture.width > WIDEST:
        picture = picture.resize((WIDEST, max(1, round(picture.height * WIDEST / picture.width))))
    return picture


def _sheet(rows: dict[str, list[Image.Image]]) -> bytes:
    """A row for each: the reference, what is tested, and where they differ."""
    from service.formats.images.contact_sheet import ContactSheet

    pictures = [picture for row in rows.values() for picture in row]
    cell = max(picture.width for picture in pictures), max(picture.height for picture in pictures)
    layout = ContactSheet(cell, ["reference", "tested", "where they differ"], list(rows))
    out = io.BytesIO()
    layout.drawn(pictures.__getitem__, lambda _: "").save(out, "PNG")
    return out.getvalue()


def _junit(folder: str, cases: list[Case], error: comparing.CouldNotCompare | None) -> bytes:
    """The report as continuous integration reads it. A case without a verdict, as the server failed, is an error."""
    failures = sum(case.failure is not None for case in cases)
    missing = [case for case in cases if case.verdict is None and not case.only_in]
    seconds = f"{sum(case.seconds for case in cases):.3f}"
    counts = {"tests": str(len(cases)), "failures": str(failures), "errors": str(len(missing)), "time": seconds}
    suites = ElementTree.Element("testsuites", counts)
    suite = ElementTree.SubElement(suites, "testsuite", {"name": "sunbox", **counts})
    for case in cases:
        names = {"classname": Path(folder).name or folder, "name": case.name, "time": f"{case.seconds:.3f}"}
        element = ElementTree.SubElement(suite, "testcase", names)
        if case.failure is not None:
            ElementTree.SubElement(element, "failure", {"message": case.failure}).text = _regions(case)
        elif case.verdict is None:
            why = "; ".join(error.lines) if error is not None else "it was not compared"
            ElementTree.SubElement(element, "error", {"message": why})
    ElementTree.indent(suites)
    return bytes(ElementTree.tostring(suites, encoding="utf-8", xml_declaration=True)) + b"\n"


def _regions(case: Case) -> str:
    """A line for each place where it differs."""
    found = case.verdict.regions if case.verdict is not None else []
    return "\n".join(f"{r.width} x {r.height} pixels at ({r.x}, {r.y}): p = {r.p_value:.2g}" for r in found)
