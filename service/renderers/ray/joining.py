"""How the gateway joins a Ray cluster, or says why it can't."""

from __future__ import annotations

import logging
import os
import socket
import time
from contextlib import suppress
from pathlib import Path
from typing import Any, cast

from service.renderers.ray.control import Join, Joined
from service.renderers.ray.renderers import plan, room

ANSWER_S = 5.0  # for the head to accept a connection; Ray itself waits for two minutes
INSTALL = (
    "SUNBOX_RAY is set, and Ray is not installed here (extra `ray` of sunbox-server): pip install 'ray>=2.60,<2.61'"
)


log = logging.getLogger(__name__)


class CannotJoin(Exception):
    """The text names the variable that is wrong."""


def join(ask: Join) -> bool:
    """Make this process a driver of the cluster; whether that was started for it.

    Raises CannotJoin; may wait for long where a head hangs.
    """
    try:
        import ray
    except ImportError as error:
        raise CannotJoin(f"{INSTALL} ({error})") from None

    named = os.environ.get("RAY_ADDRESS", "") if ask.address == "auto" else ask.address
    variable = "RAY_ADDRESS (SUNBOX_RAY is auto)" if ask.address == "auto" and named else "SUNBOX_RAY"
    local = not named and not _runs_here()
    if named not in ("", "auto", "local"):
        _answers(variable, named)
    # Workers' output stays in Ray's own files on their nodes; only what our own loggers write is in our log.
    quietly: dict[str, Any] = {"log_to_driver": False, "configure_logging": False}
    try:
        if local:
            _stay_on_this_machine()
            ray.init(address="local", include_dashboard=False, **quietly)
        else:
            ray.init(address=named or "auto", **quietly)
    except (Exception, SystemExit) as error:  # Ray ends its process where the head does not answer as one
        raise CannotJoin(
            f"{variable}: could not join the Ray cluster {named or 'of this machine'}: {error}"
        ) from None
    return local


def has_token() -> bool:
    """True if this process shows a token to the cluster, and takes requests with that token alone."""
    from ray._private.authentication.authentication_utils import is_token_auth_enabled

    return bool(is_token_auth_enabled())


def close_token_file() -> None:
    """Leave the token in the home folder to its owner: Ray and `ray get-auth-token --generate` make it as the umask
    says, so that all users could read it, and run programs as this one."""
    path = Path.home() / ".ray" / "auth_token"
    with suppress(OSError):  # there is none, or it is another user's
        if path.stat().st_mode & 0o077:
            path.chmod(0o600)
            log.info("left the token of Ray to its owner", {"path": path})


def _stay_on_this_machine() -> None:
    """Have a cluster that is about to be started listen on the loopback address alone.

    Ray has no public way: it replaces 127.0.0.1 by an address that others reach, unless clusters of several machines
    are switched off. The variable for that is named after the systems where they are off by default.
    """
    from ray._private import ray_constants

    os.environ[ray_constants.ENABLE_RAY_CLUSTERS_ENV_VAR] = "0"  # for Ray's processes
    ray_constants.ENABLE_RAY_CLUSTER = False


def survey(ask: Join, local: bool) -> Joined:
    """The resources of the cluster that was joined, and each renderer's share of them; may wait for `ask.nodes_s`."""
    import ray

    nodes = _nodes(ask)
    number, resources = plan(nodes, ask.renderers, ask.gpu)
    address = ray.get_runtime_context().gcs_address
    return Joined(address, local, number, resources, room(nodes, resources))


def _nodes(ask: Join) -> list[dict[str, float]]:
    """The resources of each node, as soon as there is one that can render; what it declares depends on them."""
    import ray

    until = time.monotonic() + ask.nodes_s
    while True:
        nodes = [node["Resources"] for node in cast(Any, ray).nodes() if node["Alive"]]
        if ask.gpu or any(node.get("GPU") or node.get("CPU") for node in nodes):
            return nodes
        if time.monotonic() > until:
            log.warning("no node of the cluster can render yet: each renderer declares one processor")
            return nodes
        time.sleep(0.5)


def _runs_here() -> bool:
    """True if the cluster that was started here last still runs; Ray would wait for one that was killed."""
    from ray._private.utils import read_ray_address

    address = read_ray_address()
    if address is not None:
        with suppress(CannotJoin):
            _answers("", address)
            return True
    return False


def _answers(variable: str, address: str) -> None:
    host, _, port = address.rpartition(":")
    try:
        socket.create_connection((host.strip("[]"), int(port)), ANSWER_S).close()
    except ValueError:
        raise CannotJoin(f"{variable}: {address!r} is neither HOST:PORT nor auto") from None
    except OSError as error:
        reason = error.strerror or error
        raise CannotJoin(f"{variable}: no Ray cluster answers at {address} ({reason})") from None
