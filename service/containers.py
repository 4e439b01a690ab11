"""Tells if this process is in a container, where processors are shared by other rules than priorities."""

from __future__ import annotations

import os

MARKS = ("/.dockerenv", "/run/.containerenv")  # files that Docker and Podman put into each
VARIABLES = ("KUBERNETES_SERVICE_HOST", "container")  # of Kubernetes, and of systemd-nspawn and LXC


def in_container() -> bool:
    return any(os.path.exists(path) for path in MARKS) or any(os.environ.get(name) for name in VARIABLES)
