"""The command line: `sunbox serve | render | sweep | turntable | compare | test | renders | bsdf | import | ...`.

Everything heavy is imported by the command that needs it: a scene with a mistake is refused before OpenGL is loaded.
Exit codes: 0 done, 1 the machine could not do it, 2 the input was wrong, 128 + n ended by signal n.
"""

from __future__ import annotations

import argparse
import atexit
import gc
import os
import sys
from collections.abc import Callable, Sequence
from importlib import import_module, metadata

from service.cli import CommandError
from service.system.garbage import loaded
from service.views import AOVS, BSDF_KINDS, COLOR_SPACES, DEFAULT_TONE_MAP, LOSSLESS_FORMATS, MAPS, TONE_MAPS

MOST_JOBS = 256  # of `warm`
BENCHES = ("speed", "gpu", "tradeoff", "seeds", "scale")
LOAD_THEMSELVES = ("render", "serve")  # commands that load most modules while they run, and call `loaded` after that


def program() -> int:
    """The entry point of `sunbox` as a process of its own; returns the exit code.

    The process ends as soon as its threads have ended and all that was registered for its end has run: to free every
    object first, as Python does, takes 0.1 s, a seventh of a small render.
    """
    codes: list[int] = []
    atexit.register(_end, codes)  # the first to be registered is the last to run
    gc.disable()
    codes.append(main())
    return codes[0]


def _end(codes: list[int]) -> None:
    """End the process with the code of its command; nothing happens where the command did not come to its end."""
    if codes:
        for stream in (sys.stdout, sys.stderr):
            if not stream.closed:
                stream.flush()
        os._exit(codes[0])


def main(arguments: Sequence[str] | None = None) -> int:
    """The exit code. What went wrong is one line or a few on stderr, never a traceback."""
    parsed = parser().parse_args(arguments)
    # Nothing here multiplies large matrices, and a pool of threads for that costs 60 ms at every start.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    run = import_module(f"service.cli.{parsed.command.replace('-', '_')}").run
    if parsed.command not in LOAD_THEMSELVES:
        loaded()
    return exit_code(lambda: run(parsed))


def exit_code(run: Callable[[], int]) -> int:
    """The exit code of a command, whose errors are printed."""
    try:
        return int(run())
    except CommandError as error:
        for line in error.lines:
            print(f"error: {line}", file=sys.stderr)
        return error.exit_code
    except KeyboardInterrupt:
        return 130
    except MemoryError:
        print("error: out of memory", file=sys.stderr)
        return 1
    except BrokenPipeError:  # `sunbox info | head`: whoever read has seen enough
        sys.stderr.close()
        return 141


def parser() -> argparse.ArgumentParser:
    top = argparse.ArgumentParser("sunbox", description="A progressive path tracer: JSON scenes in, pictures out.")
    top.add_argument("--version", action="version", version=f"sunbox {metadata.version('sunbox')}")
    commands = top.add_subparsers(dest="command", required=True, metavar="COMMAND")
    _serve(commands.add_parser("serve", help="serve the editor and the API"))
    _render(commands.add_parser("render", help="render a scene to a file"))
    _sweep(commands.add_parser("sweep", help="render a scene with other values, onto a contact sheet"))
    _turntable(commands.add_parser("turntable", help="render a turn of the camera about its target, as an animation"))
    _compare(commands.add_parser("compare", help="say whether two scenes or pictures differ beyond noise"))
    _test(commands.add_parser("test", help="compare the scenes of a folder with those of another"))
    _renders(commands.add_parser("renders", help="submit renders to a server, list them, wait for them, fetch them"))
    _bsdf(commands.add_parser("bsdf", help="draw a material's BSDF, or write it as a table"))
    _import(commands.add_parser("import", help="turn a model into a scene's JSON and its assets"))
    _export(commands.add_parser("export", help="turn a scene into a file for another program"))
    _info(commands.add_parser("info", help="say what would render, and what a scene contains and needs"))
    _warm(commands.add_parser("warm", help="compile kernels before a server needs them"))
    _check_data(commands.add_parser("check-data", help="say whether the data folder is sound"))
    _mcp(commands.add_parser("mcp", help="serve tools for agents on stdin and stdout, by the Model Context Protocol"))
    commands.add_parser("callback-secret", help="print the secrets that sign callbacks, one a line")
    _bench(commands.add_parser("bench", help="measure"))
    return top


def _serve(command: argparse.ArgumentParser) -> None:
    add = command.add_argument
    add("--host", help="address to listen on (default: SUNBOX_HOST or 127.0.0.1)")
    add("--port", type=_port, help="port to listen on (default: SUNBOX_PORT or 8000)")


def _render(command: argparse.ArgumentParser) -> None:
    add = command.add_argument
    text = "a scene's JSON, a glTF, OBJ, PLY or STL model, or a PNG or EXR that Sunbox made"
    add("input", metavar="INPUT", help=text)
    _picture(command)
    _settings(command)
    add("--stats", metavar="FILE", help="also write samples, noise, times, warnings and settings, as JSON")
    _entry(command)
    _asset_root(command)


def _settings(command: argparse.ArgumentParser) -> None:
    add = command.add_argument
    spp = "samples per pixel: the setting max_samples"
    add("--spp", dest="set", action="append", type=_setting("max_samples"), metavar="N", help=spp)
    add("--seed", dest="set", action="append", type=_setting("seed"), metavar="N", help="the setting seed")
    add("--set", action="append", metavar="KEY=VALUE", help="any setting; its value in JSON or a bare word")


def _picture(command: argparse.ArgumentParser) -> None:
    add = command.add_argument
    endings = _any_of([f".{name}" for name in LOSSLESS_FORMATS])
    add("-o", "--output", required=True, metavar="OUT", help=f"the picture: {endings}")
    aovs = f"{_any_of(AOVS[1:])} instead of {AOVS[0]}; all: each a layer of an .exr"
    add("--aov", metavar="NAME", help=aovs)
    add("--exposure", metavar="STOPS", help="for .png (default: 0)")
    curves = [f"{name} (default)" if name == DEFAULT_TONE_MAP else name for name in TONE_MAPS]
    add("--tone-map", metavar="NAME", help=f"for .png: {_any_of([*curves, 'ocio:DISPLAY/VIEW'])}")
    add("--color-space", metavar="NAME", help=f"for .png: {_any_of(COLOR_SPACES)}")
    add("--cryptomatte", action="store_true", help="for .exr: what shapes and materials cover of each pixel, too")
    add("--lut", metavar="CUBE", help="for .png: a .cube file, through which displayed colours go last")


def _sweep(command: argparse.ArgumentParser) -> None:
    _batch(command, "the contact sheet: .png, .jpg or .webp; or all pictures: .zip")
    text = "values at a JSON pointer into the scene, as /materials/ball/roughness=0.1,0.5; more axes multiply"
    command.add_argument("--over", action="append", required=True, metavar="/PATH=A,B", help=text)


def _turntable(command: argparse.ArgumentParser) -> None:
    _batch(command, "the animation: .webp, .png (APNG), .gif, .avif or .mp4; or all pictures: .zip")
    add = command.add_argument
    add("--frames", type=int, default=36, metavar="N", help="pictures of the turn (default: 36)")
    add("--degrees", type=float, default=360.0, metavar="D", help="of the turn, about +Y (default: 360)")
    add("--fps", type=float, default=24.0, metavar="N", help="pictures a second (default: 24)")


def _batch(command: argparse.ArgumentParser, output: str) -> None:
    add = command.add_argument
    add("input", metavar="INPUT", help="a scene's JSON, or a PNG or EXR that Sunbox made")
    add("-o", "--output", required=True, metavar="OUT", help=output)
    add("--width", type=int, metavar="N", help="pixels of each picture in OUT, which are scaled down to it")
    add("--exposure", type=float, default=0.0, metavar="STOPS", help="of the pictures (default: 0)")
    _settings(command)
    add("--server", metavar="URL", help="a server that renders it (default: this machine, without one)")
    _entry(command)
    _asset_root(command)


def _compare(command: argparse.ArgumentParser) -> None:
    add = command.add_argument
    for name in "ab":
        text = "a scene's JSON, a PNG or EXR that Sunbox made, or the id of a render on --server"
        add(name, metavar=name.upper(), help=f"{text}; of an EXR with --aov all its own samples are compared")
    add("-o", "--output", metavar="MAP", help="also write a map of where they differ: .png")
    _verdict(command)
    command.epilog = "Exit codes: 0 the same within noise, 1 different, 2 bad input, 3 it could not be told."


def _test(command: argparse.ArgumentParser) -> None:
    add = command.add_argument
    add("folder", metavar="FOLDER", help="scenes (.json) to test, and EXR files with every layer (--aov all)")
    text = "the folder with what they are to look like, under the same names: .json or .exr"
    add("--against", required=True, metavar="REF", help=text)
    add("-o", "--output", metavar="SHEET", help="also write a contact sheet of those that differ: .png")
    add("--junit", metavar="REPORT", help="also write a report for continuous integration: .xml")
    _verdict(command)
    text = "0 all are the same within noise, 1 one differs or is in one folder only, 2 bad input, 3 it could not be "
    command.epilog = f"Exit codes: {text}told."


def _verdict(command: argparse.ArgumentParser) -> None:
    add = command.add_argument
    text = "how sure it has to be: false alarms come at one minus that, or less (default: 0.999)"
    add("--confidence", type=float, default=0.999, metavar="C", help=text)
    text = f"what the map shows: {_any_of(MAPS)} (default: p, how sure it is)"
    add("--map", choices=MAPS, default=MAPS[0], help=text)
    _settings(command)
    add("--server", metavar="URL", help="a server that renders it (default: this machine, without one)")
    _asset_root(command)


def _renders(command: argparse.ArgumentParser) -> None:
    text = "the server's address (default: http://SUNBOX_HOST:SUNBOX_PORT); SUNBOX_API_KEY is sent to it"
    command.add_argument("--server", metavar="URL", help=text)
    actions = command.add_subparsers(dest="action", required=True, metavar="ACTION")
    submit = actions.add_parser("submit", help="start a render and print its id")
    submit.add_argument("input", metavar="INPUT", help="a scene's JSON, or a PNG or EXR that Sunbox made")
    _settings(submit)
    submit.add_argument("--label", metavar="TEXT", help="to list it by")
    submit.add_argument("--priority", type=int, metavar="N", help="-10 to 10, higher ones first (default: 0)")
    text = "a name of your own: the same render again instead of a second one, for 24 h"
    submit.add_argument("--idempotency-key", metavar="KEY", help=text)
    text = "a URL that the server posts to at its end, on a host of its SUNBOX_CALLBACK_HOSTS"
    submit.add_argument("--callback", metavar="URL", help=text)
    _asset_root(submit)
    listed = actions.add_parser("list", help="your renders, the newest first")
    listed.add_argument("--label", metavar="TEXT", help="only those with this label")
    listed.add_argument("--state", metavar="STATE", help="only queued, running, done, cancelled or failed ones")
    listed.add_argument("--limit", type=int, default=100, metavar="N", help="no more than these (default: 100)")
    for name, text in (
        ("show", "its status, as JSON"),
        ("wait", "show its progress until it ends; exit code 1 unless it is done"),
        ("fetch", "write the image so far to a file"),
        ("cancel", "end it; the image so far stays. One that has ended stays as it is"),
        ("delete", "end it, and delete it and its image"),
    ):
        action = actions.add_parser(name, help=text)
        action.add_argument("id", metavar="ID")
        if name == "fetch":
            _picture(action)


def _bsdf(command: argparse.ArgumentParser) -> None:
    add = command.add_argument
    add("material", metavar="MATERIAL.json", help="a material without textures, as a scene's `materials` holds it")
    add("-o", "--output", required=True, metavar="OUT", help="a table, .csv, or a figure, .svg or .png")
    add("--kind", choices=BSDF_KINDS, default=BSDF_KINDS[0], help=f"what to show (default: {BSDF_KINDS[0]})")
    text = "of the direction that is seen from, for polar and geometry, 0 to 89.9; may be given again (default: 45)"
    add("--angle", action="append", metavar="DEGREES", help=text)
    add("--with", dest="other", metavar="OTHER.json", help="another material to compare with")
    add("--lobes", action="store_true", help="of polar, also each lobe by itself: diffuse, specular, ...")


def _any_of(names: Sequence[str]) -> str:
    return f"{', '.join(names[:-1])} or {names[-1]}"


def _info(command: argparse.ArgumentParser) -> None:
    command.add_argument("scene", nargs="?", metavar="SCENE", help="a scene's JSON, or a glTF, OBJ, PLY or STL model")
    text = "also compile the scene's kernel and one with all common features, and measure both: a minute or more"
    command.add_argument("--measure", action="store_true", help=text)
    _entry(command)
    _asset_root(command)


def _mcp(command: argparse.ArgumentParser) -> None:
    text = "the server's address (default: SUNBOX_URL, or http://127.0.0.1:8000); SUNBOX_API_KEY is sent to it"
    command.add_argument("--url", metavar="URL", help=text)


def _warm(command: argparse.ArgumentParser) -> None:
    add = command.add_argument
    text = "a scene that will be edited, besides the built-in ones: JSON, or a glTF, OBJ, PLY or STL model"
    add("scenes", nargs="*", metavar="SCENE", help=text)
    add("--jobs", type=_jobs, metavar="N", help="processes that compile (default: one for each processor)")
    _asset_root(command)


def _check_data(command: argparse.ArgumentParser) -> None:
    text = "the folder, which a server may be using (default: SUNBOX_DATA_DIR)"
    command.add_argument("folder", nargs="?", metavar="FOLDER", help=text)


def _asset_root(command: argparse.ArgumentParser) -> None:
    text = "a folder that assets may come from besides the scene's own; may be given again"
    command.add_argument("--asset-root", action="append", default=[], metavar="DIR", help=text)


def _entry(command: argparse.ArgumentParser) -> None:
    command.add_argument("--entry", metavar="NAME", help="the model to take from a zip that holds several")


def _import(command: argparse.ArgumentParser) -> None:
    command.add_argument(
        "model",
        metavar="MODEL",
        help="a .glb, .ply, .stl or .usdz; a .gltf or .obj with its files beside it; a .zip of a model and its "
        "files; or a .zip or a folder of textures whose names say what they are",
    )
    text = "the scene; its meshes and images go into a folder beside it, named like it and ending in .assets"
    command.add_argument("-o", "--output", required=True, metavar="SCENE.json", help=text)
    command.add_argument("--variant", metavar="NAME", help="a glTF file's materials in this variant")
    command.add_argument("--animation", metavar="NAME", help="a glTF file as this animation has it")
    command.add_argument("--time", type=float, metavar="S", help="at this time in the animation (default: its start)")
    _entry(command)
    _asset_root(command)


def _export(command: argparse.ArgumentParser) -> None:
    text = "a scene's JSON, a glTF, OBJ, PLY or STL model, or a PNG or EXR that Sunbox made"
    command.add_argument("input", metavar="SCENE", help=text)
    text = "the file, whose ending says its format: .glb, .mtlx. What it has no place for is printed on stderr"
    command.add_argument("-o", "--output", required=True, metavar="OUT", help=text)
    _entry(command)
    _asset_root(command)


def _bench(command: argparse.ArgumentParser) -> None:
    add = command.add_argument
    add(
        "what",
        nargs="?",
        choices=BENCHES,
        default="speed",
        help="speed (default): paths per second, compile times, growth with triangles, latencies; "
        "gpu: what a device can do, from its limits to first frames, in about ten minutes; "
        "tradeoff: the price list, what every knob that buys speed costs in error; "
        "seeds: the experiments of the programs that Sunbox grew out of, repeated; "
        "scale: what several renderers gain",
    )
    add("-o", "--output", metavar="FILE", help="also write the figures as JSON")
    text = "tradeoff: write docs/tradeoff.* and the price list that is served; seeds: write docs/experiments*; "
    text += "scale: write docs/scaling.*"
    add("--publish", action="store_true", help=text)
    text = "tradeoff, seeds, scale: try it out on little; its figures mean nothing"
    add("--quick", action="store_true", help=text)
    text = "scale: also simulate 1, 2, 4 ... N renderers on hosts of their own"
    add("--simulate", type=int, metavar="N", help=text)
    add("--runs", type=int, default=5, metavar="N", help="runs a scene, of which the median counts (default: 5)")
    add("--seconds", type=float, default=600.0, metavar="S", help="gpu: about how long it may take (default: 600)")
    add("--device", type=int, metavar="N", help="gpu: the number of the EGL device (default: EGL's own choice)")
    add("--mesh", metavar="FILE", help="measure this mesh instead of the generated one")
    add("--environment", metavar="FILE", help="light the scenes with this HDR image instead of the generated one")


def _setting(name: str) -> Callable[[str], str]:
    return lambda value: f"{name}={value}"


def _jobs(text: str) -> int:
    if not text.isascii() or not text.isdigit() or not 1 <= int(text) <= MOST_JOBS:
        raise argparse.ArgumentTypeError(f"{text!r} is no number of processes: a whole number from 1 to {MOST_JOBS}")
    return int(text)


def _port(text: str) -> int:
    if not text.isascii() or not text.isdigit() or int(text) > 65535:
        raise argparse.ArgumentTypeError(f"{text!r} is not a port: a whole number from 0 to 65535")
    return int(text)


if __name__ == "__main__":
    sys.exit(program())
