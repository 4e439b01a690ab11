"""Whether this machine has power to spare for work that nobody asked for."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

SUPPLIES = Path("/sys/class/power_supply")  # Linux' power supply class
QUOTA = Path("/sys/fs/cgroup/cpu.max")  # of a control group, version 2: microseconds of a processor, of how many


def has_power_to_spare() -> bool:
    """False on battery, and in a container that gets less than one whole processor."""
    return not _on_battery() and _processors() >= 1.0


def _on_battery() -> bool:
    """Whether there is a battery and no adapter is plugged in."""
    kinds = [(_read(each / "type"), _read(each / "online")) for each in SUPPLIES.glob("*")]
    return any(kind == "Battery" for kind, _ in kinds) and ("Mains", "1") not in kinds and ("USB", "1") not in kinds


def _processors() -> float:
    """How many processors' time this process's control group may use; infinite where there is no bound."""
    quota, _, period = _read(QUOTA).partition(" ")
    return int(quota) / int(period) if quota.isdigit() and period.isdigit() and int(period) else float("inf")


def _read(path: Path) -> str:
    with suppress(OSError):
        return path.read_text().strip()
    return ""
