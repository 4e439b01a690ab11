"""What the service uses of uvicorn and Ray that these do not promise is there. A release of theirs that renames it
fails here, and not in the middle of an answer, where a missing attribute reads as "idle"."""

from __future__ import annotations

import ast
import asyncio
import importlib
import inspect
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import uvicorn
from uvicorn.protocols.http.h11_impl import H11Protocol, RequestResponseCycle
from uvicorn.server import ServerState

from service.server import app
from service.server.http import connection_limits, connections

SERVICE = Path(app.__file__).parents[1]
MORE = {"_end"}  # methods that uvicorn does not know


def used(source: str, name: str) -> set[str]:
    """The attributes that are read of what is called `name`, also by getattr."""
    found = set[str]()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id == name:
            found.add(node.attr)
        elif isinstance(node, ast.Call) and getattr(node.func, "id", "") == "getattr":
            holder, attribute = node.args[:2]
            if isinstance(holder, ast.Name) and holder.id == name and isinstance(attribute, ast.Constant):
                found.add(str(attribute.value))
    return found


def test_a_connection_of_uvicorn_has_what_is_read_of_it() -> None:
    async def made() -> H11Protocol:
        return H11Protocol(uvicorn.Config(lambda: None), ServerState(), {})

    theirs = asyncio.run(made())
    source = inspect.getsource(connection_limits)
    ours = {"began"}
    read = used(source, "connection") - ours
    assert {"cycle", "conn", "timeout_keep_alive_task", "transport"} <= read
    assert not [name for name in read if not hasattr(theirs, name)]
    assert not [name for name in ("app", "connections") if not hasattr(theirs, name)]
    cycles = inspect.getsource(RequestResponseCycle)
    for name in used(source, "cycle"):
        assert f"self.{name} = " in cycles, name


@pytest.mark.parametrize("kind", [connections.Connection, app._Server])
def test_each_method_in_the_place_of_uvicorn_s_has_one_there(kind: type) -> None:
    """Of the same arguments, and awaited like that."""
    (base,) = kind.__bases__
    own = {name: each for name, each in vars(kind).items() if inspect.isfunction(each) and name not in MORE}
    assert own
    for name, method in own.items():
        theirs = getattr(base, name)
        assert inspect.iscoroutinefunction(theirs) == inspect.iscoroutinefunction(method), name
        assert name == "__init__" or list(inspect.signature(theirs).parameters) == list(
            inspect.signature(method).parameters
        )


def private_names() -> Iterator[tuple[str, str, set[str]]]:
    """Modules of Ray's own, names in them, and attributes that are read of these."""
    for path in SERVICE.rglob("*.py"):
        source = path.read_text()
        for node in ast.walk(ast.parse(source)):
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("ray._"):
                for alias in node.names:
                    yield str(node.module), alias.name, used(source, alias.asname or alias.name)


@pytest.mark.ray
def test_ray_has_what_is_used_of_its_own() -> None:
    found = list(private_names())
    assert len(found) >= 5
    for module, name, attributes in found:
        try:
            value: Any = getattr(importlib.import_module(module), name)
        except AttributeError:  # a module
            value = importlib.import_module(f"{module}.{name}")
        missing = [each for each in attributes if not hasattr(value, each)]
        assert not missing, f"{module}.{name} has no {missing}"
    assert hasattr(importlib.import_module("ray.actor").ActorHandle, "_actor_id")
