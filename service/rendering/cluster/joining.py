"""How the gateway joins a Ray cluster, or says why it can't."""

from __future__ import annotations

import os
import socket
from typing import Any, cast

from service.rendering.cluster.control import Join, Joined
from service.rendering.cluster.renderers import plan

ANSWER_S = 5.0  # for the head to accept a connection; Ray itself waits for two minutes
INSTALL = "SUNBOX_RAY is set, and Ray is not installed here: pip install 'sunbox[ray]'"


class CannotJoin(Exception):
    """The text names the variable that is wrong."""


def join(ask: Join) -> Joined:
    """Make this process a driver of the cluster. Raises CannotJoin; may wait for long where a head hangs."""
    try:
        import ray
    except ImportError as error:
        raise CannotJoin(f"{INSTALL} ({error})") from None

    named = os.environ.get("RAY_ADDRESS", "") if ask.address == "auto" else ask.address
    variable = "RAY_ADDRESS (SUNBOX_RAY is auto)" if ask.address == "auto" and named else "SUNBOX_RAY"
    if named and named != "auto" and named != "local":
        _answers(variable, named)
    local = False
    try:
        # Workers' output stays in Ray's own files on their nodes; only what our own loggers write is in our log.
        ray.init(address=named or "auto", log_to_driver=False, configure_logging=False)
    except ConnectionError as error:
        if named:
            raise CannotJoin(f"{variable}: {error}") from None
        local = True
        ray.init(address="local", include_dashboard=False, log_to_driver=False, configure_logging=False)
    except (Exception, SystemExit) as error:  # Ray ends its process where the head is none of Ray's
        raise CannotJoin(f"{variable}: could not join the Ray cluster {named or 'that runs here'}: {error}") from None
    nodes = [node["Resources"] for node in cast(Any, ray).nodes() if node["Alive"]]
    number, resources = plan(nodes, ask.renderers, ask.gpu)
    return Joined(ray.get_runtime_context().gcs_address, local, number, resources)


def _answers(variable: str, address: str) -> None:
    host, _, port = address.rpartition(":")
    try:
        socket.create_connection((host.strip("[]"), int(port)), ANSWER_S).close()
    except ValueError:
        raise CannotJoin(f"{variable}: {address!r} is neither HOST:PORT nor auto") from None
    except OSError as error:
        reason = error.strerror or error
        raise CannotJoin(f"{variable}: no Ray cluster answers at {address} ({reason})") from None
