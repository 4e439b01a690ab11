"""`sunbox serve` in a process of its own."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
import urllib.error
import urllib.request
from collections.abc import Mapping
from pathlib import Path
from typing import Any

PATIENCE_S = 60.0


class Server:
    """`sunbox serve` on a free port."""

    def __init__(self, folder: Path, settings: Mapping[str, str] | None = None) -> None:
        """`settings` are further variables of its environment. Raises RuntimeError with its log where it does not
        start."""
        environment = {name: value for name, value in os.environ.items() if not name.startswith("SUNBOX_")}
        environment |= {"SUNBOX_DATA_DIR": str(folder), "SUNBOX_LOG_LEVEL": "error", **(settings or {})}
        command = [sys.executable, "-m", "service.cli", "serve", "--port", "0"]
        with (folder / "server.log").open("wb") as log:
            self.process = subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, stderr=log, text=True)
        assert self.process.stdout is not None
        said = self.process.stdout.readline()
        if "http://" not in said:
            raise RuntimeError((folder / "server.log").read_text()[-1000:])
        self.url = said[said.index("http://") :].strip().rstrip("/")

    @property
    def pid(self) -> int:
        return self.process.pid

    def ask(
        self, method: str, path: str, body: bytes | Any = None, headers: Mapping[str, str] | None = None
    ) -> tuple[int, bytes]:
        """The status and body of an answer; status 0 where there was none."""
        data = body if body is None or isinstance(body, bytes) else json.dumps(body).encode()
        request = urllib.request.Request(self.url + path, data, dict(headers or {}), method=method)
        request.add_header(
            "content-type", "application/octet-stream" if isinstance(body, bytes) else "application/json"
        )
        try:
            with urllib.request.urlopen(request, timeout=PATIENCE_S) as answer:
                return answer.status, answer.read()
        except urllib.error.HTTPError as error:
            return error.code, error.read()
        except OSError:
            return 0, b""

    def children(self) -> list[int]:
        found = subprocess.run(["ps", "-o", "pid=", "--ppid", str(self.pid)], capture_output=True, text=True)
        return [int(pid) for pid in found.stdout.split()]

    def stop(self) -> tuple[int, int]:
        """The exit code after SIGTERM, and how many children were left."""
        children = self.children()
        self.process.terminate()
        try:
            code = self.process.wait(20)
        except subprocess.TimeoutExpired:
            self.process.kill()
            code = -9
        return code, still_there(children, 1.0)


def still_there(pids: list[int], within_s: float) -> int:
    """How many of these processes have not ended `within_s` seconds from now."""
    until = time.monotonic() + within_s
    while (left := sum(_lives(pid) for pid in pids)) and time.monotonic() < until:
        time.sleep(0.1)
    return left


def _lives(pid: int) -> bool:
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except OSError:
        return False
    return state != "Z"  # one that has ended and waits for its parent
