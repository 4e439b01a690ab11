"""The service's configuration: SUNBOX_* in the environment, every limit in one place."""

from __future__ import annotations

import ipaddress
import os
import re
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    ValidationError,
    ValidationInfo,
    field_validator,
    model_validator,
)

from service.callback_hosts import checked_hosts, checked_secrets
from service.containers import in_container
from service.quantities import Bytes, Seconds

MAX_PIXELS = 16_777_216  # 4096 x 4096: the accumulators of one picture stay below 2 GiB
MIB, GIB = 2**20, 2**30

LIMITS = ("max_", "keep_", "parse_", "body_", "data_quota", "data_files")  # how the names of limits begin

HOST = re.compile(r"[A-Za-z0-9._-]+|\[?[0-9A-Fa-f:.]+\]?")  # a name, an IPv4 or an IPv6 address

LLVMPIPE = "llvmpipe:"  # before the number of renderers, in SUNBOX_DEVICES
MOST_CROWDED = 16  # renderers on a processor with fewer cores: a test of several may want them, more are a slip
NUMBER = re.compile(r"[0-9]{1,6}")

ADDRESS = re.compile(rf"(?:{HOST.pattern}):[0-9]{{1,5}}")

NICENESS = 5  # steps, where the machine may be somebody's desktop: a quarter of a processor beside a busy program
Ahead = Literal["off", "some", "all"]  # kernels that are compiled before anybody waits for them
PREFIX = "SUNBOX_"  # how the names of all variables begin, in capitals or not
# Fields whose variables are lists, separated by commas.
WORDS = (
    "allowed_hosts", "allowed_origins", "api_key", "callback_hosts", "callback_secret", "devices", "trusted_proxies",
)  # fmt: skip


class ConfigError(Exception):
    """A variable of the environment is invalid; the text is for the person who started the service."""


def _default_data_dir() -> Path:
    cache = os.environ.get("XDG_CACHE_HOME", "")
    # The XDG specification asks for relative paths in there to be ignored.
    return (Path(cache) if os.path.isabs(cache) else Path.home() / ".cache") / "sunbox"


class Config(BaseModel):
    """Each field that is not given is read from SUNBOX_ and its name in capitals; the descriptions are the table of
    docs/operation.md."""

    model_config = ConfigDict(frozen=True, extra="ignore", validate_default=True)

    host: str = Field("127.0.0.1", description="Address to listen on.")
    port: int = Field(8000, ge=0, le=65535, description="Port to listen on; 0 takes a free one.")
    api_key: list[str] = Field(
        default_factory=list,
        repr=False,
        description="Keys, separated by commas, one of which `/v1/*` then asks for; renders and saved "
        "documents belong to their key.",
    )
    allowed_hosts: list[str] = Field(
        default_factory=list,
        description="Names besides 127.0.0.1 and localhost, separated by commas, by which this server may be reached "
        "(default: none on a loopback address, any on another).",
    )
    allowed_origins: list[str] = Field(
        default_factory=list, description="Origins besides the server's own that may call, separated by commas."
    )
    trusted_proxies: list[str] = Field(
        default_factory=list,
        description="Addresses and networks of proxies, separated by commas, whose `X-Forwarded-For` says who calls; "
        "without it that header changes nothing.",
    )
    callback_hosts: Annotated[list[str], AfterValidator(checked_hosts)] = Field(
        default_factory=list,
        description="Hosts to which [callbacks](#callbacks) may be sent, separated by commas (`hooks.example.org`, "
        "`hooks.example.org:8443`, `http://10.0.0.5:8080`), and networks that are not public in which their "
        "addresses may lie (`10.0.0.0/8`); without it callbacks are refused.",
    )
    callback_secret: Annotated[list[str], AfterValidator(checked_secrets)] = Field(
        default_factory=list,
        repr=False,
        description="Secrets that sign callbacks, separated by commas: `whsec_` and 24 to 64 bytes in base64 "
        "(default: one that is made and kept in the data folder; `sunbox callback-secret` prints it).",
    )
    data_dir: Path = Field(
        default_factory=_default_data_dir,
        description="Folder of assets, documents and renders (default: `sunbox` in `$XDG_CACHE_HOME` or `~/.cache`).",
    )
    data_quota: Bytes = Field(
        10 * GIB,
        ge=1,
        description="Most bytes of assets, documents and renders, in whole blocks; assets unused longest make room, "
        "unless documents or renders use them.",
    )
    data_files: int = Field(1_000_000, ge=1, description="Most files that they take, two for an asset.")
    device: int | None = Field(None, ge=0, description="Number of the EGL device to render on (default: the first).")
    devices: list[str] = Field(
        default_factory=list,
        description="Renderers, a process each: numbers of EGL devices, separated by commas, or `llvmpipe:N` for N "
        "that divide the processor's cores (default: one, on `SUNBOX_DEVICE`).",
    )
    ray: str | None = Field(
        None,
        description="Have the nodes of a Ray cluster render: the `HOST:PORT` of its head, or `auto`, which is Ray's "
        "own rule (`RAY_ADDRESS`, then a cluster that runs here, then a new one on this machine). Needs "
        "`ray` of `sunbox-server`.",
    )
    ray_renderers: int | None = Field(
        None, ge=1, description="Renderers in the Ray cluster (default: one a GPU, without GPUs one a node)."
    )
    require_gpu: bool = Field(False, description="Refuse to start on a software renderer.")
    require_sandbox: bool = Field(
        False, description="Refuse to start where the kernel does not confine what parses (Landlock, seccomp)."
    )
    log_format: Literal["console", "json"] = Field(
        "console", description="`console` for people, or `json`: one object a line."
    )
    log_level: Literal["debug", "info", "warning", "error"] = Field(
        "info", description="The least level that is logged: debug, info, warning or error."
    )

    max_body: Bytes = Field(256 * MIB, ge=1, description="Most bytes of a request's body; it may not be compressed.")
    max_bodies: Bytes = Field(
        GIB,
        ge=1,
        description="Most bytes of all uploads that are being received and parsed, at least four times "
        "`SUNBOX_MAX_BODY`; one caller has at most half.",
    )
    max_json: Bytes = Field(
        32 * MIB,
        ge=1,
        description="Most bytes of a JSON body; of all that wait, four times that, and half of it for one caller.",
    )
    max_json_memory: Bytes = Field(
        512 * MIB,
        ge=1,
        description="Most bytes of memory that JSON bodies take as values: one, and all that are read at a time.",
    )
    body_timeout: Seconds = Field(30.0, description="Longest pause within a body that is being sent.")
    max_connections: int = Field(
        1024, ge=2, description="Most connections at a time, streams included; one address has at most half of them."
    )
    max_clients: int = Field(64, ge=1, description="Most streams at a time; one key leaves half of them to others.")
    max_key_clients: int | None = Field(
        None, ge=1, description="Most streams at a time of one key, within its share (default: that share)."
    )
    max_stream_memory: Bytes = Field(
        512 * MIB, ge=8, description="Most bytes of memory that the streams' scenes take as values; one's, an eighth."
    )
    memory: Bytes | None = Field(
        None,
        ge=64 * MIB,
        description="Most bytes of memory that all work takes together, queued, running and kept, beside what idle "
        "processes take (default: half of the machine's, or of the container's limit).",
    )
    gpu_memory: Bytes | None = Field(
        None,
        ge=1,
        description="Most bytes of scenes and pictures on each device; the renderers of `llvmpipe:N` divide them "
        "(default: 80 % of what a GPU has free at the start, where its driver tells; `SUNBOX_MEMORY` for software "
        "renderers).",
    )
    ahead: Ahead = Field(
        "some",
        description="Which kernels are compiled before anybody waits for them: `off`, none; `some`, those that "
        "the next edit of a stream may need, and for nobody in particular at most 60 s of a processor after a start, "
        "none on battery or with less than one processor; `all`, without these bounds. With `off` there are no first "
        "looks while a kernel is compiled, either.",
    )
    nice: int = Field(
        default_factory=lambda: 0 if in_container() else NICENESS,
        ge=0,
        le=19,
        description="Steps of [niceness](#processor-time) by which renderers, and all else that works for requests, "
        "give way to other programs and to the server's answers (default: 5, and 0 in a container).",
    )
    hang_s: Seconds = Field(
        10.0,
        description="A renderer is replaced that makes no progress for so long, and for ten times its last step.",
    )
    checkpoint_s: Seconds = Field(
        4.0,
        description="How often a render is stored, to go on after the loss of its renderer or of all processes; "
        "less often where it takes longer than 1 % of that, and after 17 minutes: every 0.4 % of its time.",
    )
    max_pixels: int = Field(MAX_PIXELS, ge=1, description="Most pixels of a picture: width times height.")
    max_triangles: int = Field(
        16_000_000,
        ge=1,
        le=2**24,
        description="Most triangles that a scene holds, shared ones once, those of displaced meshes as they are cut; "
        "at most 2^24 (float32 counts no further).",
    )
    max_shapes: int = Field(200_000, ge=1, description="Most shapes of a scene; a mesh is one.")
    max_lights: int = Field(10_000, ge=1, description="Most lights of a scene that are no shapes.")
    max_materials: int = Field(10_000, ge=1, description="Most materials of a scene.")
    max_textures: int = Field(10_000, ge=1, description="Most textures of a scene.")
    max_texels: int = Field(
        2**26, ge=1, le=2**27, description="Most texels of an image, and of a scene's textures: four of 4096 x 4096."
    )
    max_asset: Bytes = Field(
        GIB, ge=1, description="Most bytes of one asset; over HTTP `SUNBOX_MAX_BODY` counts too."
    )
    parse_seconds: Seconds = Field(
        20.0, description="Longest that parsing an asset takes, and 0.25 s more for each MiB of it."
    )
    parse_memory: Bytes = Field(
        8 * GIB, ge=256 * MIB, description="Most bytes of memory that parsing an asset takes."
    )
    max_seconds: Seconds | None = Field(None, description="Longest that a picture is rendered (default: no limit).")
    max_running: int = Field(
        8,
        ge=1,
        description="Most renders at a time; others wait in line, and have [their turn](#fairness) "
        "also where these are endless.",
    )
    max_queue: int = Field(
        10_000,
        ge=1,
        description="Most renders that wait in line; a key with less than its share may add more.",
    )
    max_batch: int = Field(10_000, ge=1, le=1_000_000, description="Most renders of one batch.")
    max_jobs: int = Field(2_000, ge=1, description="Most renders, running and waiting, of one key.")
    max_key_assets: Bytes | None = Field(
        None,
        ge=1,
        description="Most bytes of the assets that one key has uploaded, of which those unused longest make room "
        "(default: no limit).",
    )
    max_key_documents: Bytes | None = Field(
        None, ge=1, description="Most bytes of one key's saved documents (default: a share of a fourth of the quota)."
    )
    keep_renders: int = Field(2_000, ge=1, description="Most ended renders that are kept for each key.")
    keep_bytes: Bytes = Field(4 * GIB, ge=1, description="Most bytes on the disk of the ended renders of all keys.")
    keep_packed: Bytes = Field(
        GIB, ge=1, description="Most bytes of packed scenes that are kept for the next edits of all streams."
    )
    keep_seconds: Seconds = Field(
        86_400.0, description="How long an ended render is kept; the time while the server is down counts."
    )

    @property
    def limits(self) -> dict[str, float | None]:
        """The limits that a caller may meet, by name; None: no such limit."""
        return {name: getattr(self, name) for name in type(self).model_fields if name.startswith(LIMITS)}

    @property
    def software_renderers(self) -> int:
        """How many renderers on the processor SUNBOX_DEVICES asks for."""
        return int(self.devices[0].removeprefix(LLVMPIPE)) if self.devices and ":" in self.devices[0] else 0

    @model_validator(mode="before")
    @classmethod
    def _given(cls, values: dict[str, Any]) -> dict[str, Any]:
        """Add the variables of the environment, and leave out those that are set to nothing, as
        `SUNBOX_DEVICE: ${SUNBOX_DEVICE:-}` in a compose file does.

        Not the keys: a secret that is empty by mistake would open the service to everybody.
        """
        given = (_variables() | values).items()
        return {name: value for name, value in given if value != "" or name == "api_key"}

    @field_validator(*WORDS, mode="before")
    @classmethod
    def _split(cls, value: Any) -> Any:
        return [part.strip() for part in value.split(",")] if isinstance(value, str) else value

    @field_validator("allowed_hosts", "allowed_origins", "trusted_proxies")
    @classmethod
    def _named(cls, names: list[str]) -> list[str]:
        return [name for name in names if name]

    @field_validator("allowed_hosts")
    @classmethod
    def _plain(cls, hosts: list[str]) -> list[str]:
        for host in hosts:
            if not HOST.fullmatch(host):
                raise ValueError(f"{host!r} is no host name; write it without scheme, port and path")
        return [host.strip("[]").lower() for host in hosts]

    @field_validator("trusted_proxies")
    @classmethod
    def _networks(cls, proxies: list[str]) -> list[str]:
        try:
            return [str(ipaddress.ip_network(proxy, strict=False)) for proxy in proxies]
        except ValueError as error:
            raise ValueError(f"{error}; write addresses like 10.0.0.1, or networks like 10.0.0.0/8") from None

    @field_validator("ray")
    @classmethod
    def _address(cls, ray: str | None, info: ValidationInfo) -> str | None:
        if ray is None:
            return None
        for name in ("device", "devices"):
            if info.data.get(name) not in (None, []):
                raise ValueError(f"cannot be set together with SUNBOX_{name.upper()}; Ray gives renderers their GPUs")
        if ray.startswith("ray://"):
            raise ValueError(
                "is not the address of Ray's client (ray://); run the server on a node, and write HOST:PORT"
            )
        if ray != "auto" and not ADDRESS.fullmatch(ray):
            raise ValueError(f"{ray!r} is neither HOST:PORT nor auto")
        return ray

    @field_validator("ray_renderers")
    @classmethod
    def _in_a_cluster(cls, count: int | None, info: ValidationInfo) -> int | None:
        if count is not None and info.data.get("ray", "") is None:
            raise ValueError("says how many renderers a Ray cluster has; set SUNBOX_RAY, too")
        return count

    @field_validator("devices")
    @classmethod
    def _devices(cls, devices: list[str], info: ValidationInfo) -> list[str]:
        if devices and info.data.get("device") is not None:
            raise ValueError("cannot be set together with SUNBOX_DEVICE; keep one of the two")
        if len(devices) == 1 and devices[0].startswith(LLVMPIPE):
            count, most = devices[0].removeprefix(LLVMPIPE), max(cores(), MOST_CROWDED)
            if not NUMBER.fullmatch(count) or not 1 <= int(count) <= most:
                wrong = f"{devices[0]!r} is not possible"
                raise ValueError(
                    f"{wrong}: the number after {LLVMPIPE} is from 1 to {most}; one for each core is fastest"
                )
            return [f"{LLVMPIPE}{int(count)}"]
        for device in devices:
            if not NUMBER.fullmatch(device):
                raise ValueError(f"{device!r} is no device; write numbers of EGL devices, or {LLVMPIPE}N alone")
        numbers = [str(int(device)) for device in devices]
        if twice := [number for number in numbers if numbers.count(number) > 1]:
            raise ValueError(f"device {twice[0]} is named twice; each has one renderer")
        return numbers

    @field_validator("api_key")
    @classmethod
    def _usable(cls, keys: list[str]) -> list[str]:
        if keys == [""]:
            raise ValueError("is set, but empty; give it one or more keys, or remove it to serve without keys")
        if "" in keys:
            raise ValueError("one of the keys is empty")
        for key in keys:
            if not all("!" <= letter <= "~" for letter in key):
                raise ValueError("a key is of printable ASCII characters without blanks, or no header could hold it")
        return keys


def cores() -> int:
    """How many cores this process may use."""
    return len(os.sched_getaffinity(0))


def _variables() -> dict[str, str]:
    """The environment's settings by the names of fields: pydantic-settings reads them so, but takes 60 ms to load."""
    given = {name.upper(): value for name, value in os.environ.items()}
    return {name.removeprefix(PREFIX).lower(): given[name] for name in given if name.startswith(PREFIX)}


def load_config(**given: Any) -> Config:
    """`given` (where not None) over the environment. Raises ConfigError naming each bad variable."""
    try:
        return Config(**{name: value for name, value in given.items() if value is not None})
    except ValidationError as error:
        lines = [f"{PREFIX}{str(e['loc'][0]).upper()}: {_said(e['msg'])}" for e in error.errors()]
        raise ConfigError("; ".join(lines)) from None


def unknown_variables() -> list[str]:
    """SUNBOX_* in the environment that are no settings: they may be misspelt ones, and the key may be among those."""
    known = {f"{PREFIX}{name.upper()}" for name in Config.model_fields}
    return sorted(name for name in os.environ if name.upper().startswith(PREFIX) and name.upper() not in known)


def _said(message: str) -> str:
    """pydantic's message as the second half of a sentence."""
    plain = message.removeprefix("Value error, ")
    return plain[:1].lower() + plain[1:]
