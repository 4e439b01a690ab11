"""The service's configuration: SUNBOX_* in the environment, every limit in one place."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, ValidationError, field_validator
from pydantic_settings import BaseSettings, NoDecode, SettingsConfigDict

MAX_PIXELS = 16_777_216  # 4096 x 4096: the accumulators of one picture stay below 1 GiB


class ConfigError(Exception):
    """The environment says something that cannot be; for whoever started the service."""


def _default_data_dir() -> Path:
    cache = os.environ.get("XDG_CACHE_HOME", "")
    # The XDG specification asks for relative paths in there to be ignored.
    return (Path(cache) if os.path.isabs(cache) else Path.home() / ".cache") / "sunbox"


class Config(BaseSettings):
    """Each field is read from SUNBOX_ and its name in capitals; the descriptions are the README's table."""

    model_config = SettingsConfigDict(env_prefix="SUNBOX_", frozen=True, extra="ignore", env_ignore_empty=True)

    host: str = Field("127.0.0.1", description="Address to listen on.")
    port: int = Field(8000, ge=0, le=65535, description="Port to listen on; 0 takes a free one.")
    max_pixels: int = Field(MAX_PIXELS, ge=1, description="Most pixels of a picture: width times height.")
    max_triangles: int = Field(
        16_000_000, ge=1, le=2**24, description="Most triangles of a scene; at most 2^24 (float32 counts no further)."
    )
    max_texels: int = Field(
        2**26, ge=1, le=2**27, description="Most texels of a scene's textures: 2^26 are four of 4096 x 4096."
    )
    max_body: int = Field(256 * 2**20, ge=1, description="Most bytes of a request's body, as decompressed.")
    max_clients: int = Field(64, ge=1, description="Most streams that are connected at a time.")
    data_dir: Path = Field(
        default_factory=_default_data_dir, description="Folder for assets and caches (default: ~/.cache/sunbox)."
    )
    device: int | None = Field(None, ge=0, description="Number of the EGL device to render on (default: the first).")
    allowed_origins: Annotated[list[str], NoDecode] = Field(
        default_factory=list, description="Origins besides the server's own that may call, separated by commas."
    )

    @field_validator("allowed_origins", mode="before")
    @classmethod
    def _split(cls, value: Any) -> Any:
        return [part.strip() for part in value.split(",") if part.strip()] if isinstance(value, str) else value


def load_config(**given: Any) -> Config:
    """`given` (where not None) over the environment. Raises ConfigError naming each bad variable."""
    try:
        return Config(**{name: value for name, value in given.items() if value is not None})
    except ValidationError as error:
        lines = [f"SUNBOX_{str(e['loc'][0]).upper()}: {e['msg'].lower()}" for e in error.errors()]
        raise ConfigError("; ".join(lines)) from None
