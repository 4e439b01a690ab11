"""The figures of `sunbox bench gpu` as they stand in the JSON file. Numbers are finite; times are in milliseconds,
memory is in bytes, rates are in millions of paths per second.
"""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

VERSION = 2

Count = Annotated[int, Field(ge=0)]
Positive = Annotated[float, Field(gt=0)]
Milliseconds = Annotated[float, Field(ge=0)]


class _Row(BaseModel):
    model_config = ConfigDict(extra="forbid", allow_inf_nan=False, frozen=True)


class Missing(_Row):
    """A figure that could not be taken."""

    what: str
    why: str


class Device(_Row):
    """The device by its driver's words, and the machine by `describe`."""

    renderer: str
    version: str
    vendor: str
    glsl: str
    software: bool  # it is the processor, so that the figures say nothing of a GPU
    memory: Count | None
    free_memory: Count | None
    subgroup_size: Count | None
    limits: dict[str, int | list[int]]


class Rate(_Row):
    """The median of several runs."""

    mpaths_per_s: Positive
    ms_per_sample: Positive  # of every pixel
    spread: Annotated[float, Field(ge=0)]  # (slowest - fastest) / median


class SizedRate(Rate):
    width: Count
    height: Count
    picture_bytes: Count  # as gpu.picture_bytes expects
    device_bytes: Count | None  # by which the device's free memory fell; None where the driver does not say


class Scene(_Row):
    scene: str
    triangles: Count
    scene_bytes: Count
    load_ms: Milliseconds  # packing and uploading
    compile_cold_ms: Milliseconds
    compile_warm_ms: Milliseconds  # with the driver's cache on the disk
    host_bytes: Count  # the greatest resident memory of the process
    sizes: list[SizedRate]


class Tree(_Row):
    scene: str
    tree: str
    node_bytes: Count
    rate: Rate


class Slice(_Row):
    """Dispatches that were asked to take `slice_ms`."""

    scene: str
    slice_ms: Positive
    median_ms: Positive
    dispatches: Count
    paths: Positive  # of a dispatch, in the mean
    rate: Rate


class Side(_Row):
    """Pictures of side x side pixels, each pass of which is one dispatch."""

    scene: str
    side: Count
    rate: Rate


class Encoded(_Row):
    format: str
    ms: Milliseconds
    bytes: Count


class Readout(_Row):
    width: Count
    height: Count
    display_ms: Milliseconds  # resolved on the device and read back, 8 bits a channel
    linear_ms: Milliseconds  # read back as sums and divided, 32 bits a channel
    encoded: list[Encoded]


class Blocks(_Row):
    """A block of samples and a band of it as high as the picture."""

    width: Count
    height: Count
    band_bytes: Count
    merge_ms: Milliseconds
    read_band_ms: Milliseconds
    write_band_ms: Milliseconds


class Kernel(_Row):
    """The kernel with every feature beside the scene's own."""

    scene: str
    full_compile_ms: Milliseconds
    time_ratio: Positive


class Caustics(_Row):
    """A sample with caustics that are traced from the lights, beside one whose camera paths find them."""

    scene: str
    light: Rate
    paths: Rate


class Pair(_Row):
    scene: str
    processes: Count
    mpaths_per_s: list[Positive]  # of each process


class Latency(_Row):
    p50_ms: Milliseconds
    p95_ms: Milliseconds


class Frames(_Row):
    """From sending a change to having the first frame that shows it, on the server's own machine."""

    width: Count
    height: Count
    start_cold_ms: Positive  # from starting the server's process, with empty caches
    start_warm_ms: Positive  # the same, with filled ones
    scene_first: Latency  # scenes that this server has not shown before
    scene_again: Latency
    material: Latency
    camera: Latency


class Report(_Row):
    version: int = VERSION
    seconds: Positive  # that were given
    took_s: Positive
    machine: dict[str, str | int | None]
    device: Device | None
    scenes: list[Scene]
    trees: list[Tree]
    slices: list[Slice]
    sides: list[Side]
    readouts: list[Readout]
    blocks: list[Blocks]
    kernels: list[Kernel]
    caustics: list[Caustics]
    pairs: list[Pair]
    frames: list[Frames]
    missing: list[Missing]
