"""What can be checked of the files for clusters without one: syntax, Ray's schema, and that their names are real."""

from __future__ import annotations

import os
import re
import subprocess
from ipaddress import ip_address, ip_network
from pathlib import Path
from typing import Any

import pytest
import yaml

from service.config import Config, load_config

ROOT = Path(__file__).parents[1]
DEPLOY = ROOT / "docs" / "deploy"


def documents(path: Path) -> list[Any]:
    return list(yaml.safe_load_all(path.read_text()))


@pytest.mark.parametrize("path", sorted(DEPLOY.glob("*.yaml")), ids=lambda path: path.name)
def test_names_are_real(path: Path) -> None:
    assert documents(path)
    known = {f"SUNBOX_{name.upper()}" for name in Config.model_fields}
    assert set(re.findall(r"SUNBOX_[A-Z_]+", path.read_text())) <= known
    assert f"docs/deploy/{path.name}" in (ROOT / "docs" / "scaling.md").read_text()


@pytest.mark.ray
def test_ray_takes_the_cluster_file(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    from ray.autoscaler._private.util import prepare_config, validate_config

    monkeypatch.setenv("HOME", str(tmp_path))
    (config,) = documents(DEPLOY / "ray-cluster.yaml")
    prepared = prepare_config(config)
    validate_config(prepared)
    workers = len(config["provider"]["worker_ips"])
    assert sum(kind["max_workers"] for kind in prepared["available_node_types"].values()) == workers
    with pytest.raises(Exception, match="max_wrokers"):
        validate_config(prepared | {"max_wrokers": 3})


def test_the_manifest_asks_for_as_many_renderers_as_there_can_be() -> None:
    cluster, claim = documents(DEPLOY / "kuberay.yaml")
    assert (cluster["apiVersion"], cluster["kind"]) == ("ray.io/v1", "RayCluster")
    spec = cluster["spec"]
    (workers,) = spec["workerGroupSpecs"]
    (head,) = spec["headGroupSpec"]["template"]["spec"]["containers"]
    given = {each["name"]: each["value"] for each in head["env"] if "value" in each}
    settings = {name.removeprefix("SUNBOX_").lower(): value for name, value in given.items()}
    config = load_config(**settings)
    assert config.ray == "auto" and config.ray_renderers == workers["maxReplicas"] > workers["minReplicas"]
    assert config.require_gpu and spec["enableInTreeAutoscaling"]
    (volume,) = spec["headGroupSpec"]["template"]["spec"]["volumes"]
    assert volume["persistentVolumeClaim"]["claimName"] == claim["metadata"]["name"]
    assert head["volumeMounts"] == [{"name": volume["name"], "mountPath": "/data"}]
    locked = re.search(r"^ray==(\S+)", (ROOT / "requirements.ray.lock").read_text(), re.MULTILINE)
    assert locked is not None and spec["rayVersion"] == locked[1]


def test_a_profile_of_compose_is_a_cluster() -> None:
    (compose,) = documents(ROOT / "compose.yaml")
    head, worker = compose["services"]["head"], compose["services"]["worker"]
    assert head["profiles"] == worker["profiles"] == ["cluster"]
    assert head["image"] == worker["image"] == "sunbox-ray" and head["build"]["args"] == {"EXTRAS": "ray"}
    assert head["environment"]["SUNBOX_RAY_RENDERERS"] == worker["deploy"]["replicas"]
    for service in (head, worker):
        assert service["environment"]["RAY_AUTH_MODE"] == "token" and service["read_only"]
    assert "SUNBOX_API_KEY" not in worker["environment"]


@pytest.mark.parametrize("file", ["compose.yaml", "docs/deploy/kuberay.yaml"])
def test_the_server_has_the_key_and_ray_has_not(file: str, tmp_path: Path) -> None:
    """What the head runs, with programs that say what their environment is."""
    first = documents(ROOT / file)[0]
    if file == "compose.yaml":
        (command,) = first["services"]["head"]["command"]
    else:
        (command,) = first["spec"]["headGroupSpec"]["template"]["spec"]["containers"][0]["args"]
    for name in ("ray", "sunbox"):
        (tmp_path / name).write_text(f'#!/bin/sh\necho "{name} $1 key=$SUNBOX_API_KEY"\n')
        (tmp_path / name).chmod(0o755)
    own = {"PATH": f"{tmp_path}:{os.environ['PATH']}", "SUNBOX_API_KEY": "anna"}
    own["KUBERAY_GEN_RAY_START_CMD"] = "ray start --head"
    done = subprocess.run(["bash", "-c", command], env=own, capture_output=True, text=True)
    said = set(done.stdout.splitlines()) - {"ray health-check key=anna"}
    assert said == {"ray start key=", "sunbox serve key=anna"}, done


def test_no_example_has_a_key_on_a_command_line() -> None:
    texts = [*DEPLOY.glob("*.yaml"), ROOT / "docs" / "scaling.md"]
    assert not [path.name for path in texts if re.search(r"SUNBOX_API_KEY=(?!\"\$)", path.read_text())]


def test_the_proxy_of_compose_is_trusted() -> None:
    """So that it has no share of its own, and its callers are told apart. Nobody else is: its address is one that
    Docker gives to no other container, nor to the host."""
    (compose,) = documents(ROOT / "compose.yaml")
    (range,) = compose["networks"]["default"]["ipam"]["config"]
    proxy = compose["services"]["proxy"]["networks"]["default"]["ipv4_address"]
    network, given_out = ip_network(range["subnet"]), ip_network(range["ip_range"])
    assert ip_address(proxy) in network and ip_address(proxy) not in given_out and given_out.subnet_of(network)
    assert ip_address(proxy) != network[1], "the host's"
    for name in ("sunbox", "sunbox-gpu", "head"):
        service = compose["services"][name]
        given = {key.removeprefix("SUNBOX_").lower(): value for key, value in service["environment"].items()}
        config = load_config(trusted_proxies=given["trusted_proxies"], max_connections=given["max_connections"])
        assert "ports" not in service and config.trusted_proxies == [f"{proxy}/32"]
        assert config.max_connections > Config.model_fields["max_connections"].default


def test_the_notebook_is_tested_with_what_is_locked() -> None:
    """CI installs this lock, too, into the same environment."""
    everything, notebook = (
        dict(re.findall(r"^([a-z0-9_.-]+)==(\S+)", (ROOT / name).read_text(), re.MULTILINE))
        for name in ("requirements.lock", "requirements.notebook.lock")
    )
    assert {"anywidget", "jupyterlab"} <= notebook.keys() and "jupyterlab" not in everything
    assert {name: everything.get(name, pin) for name, pin in notebook.items()} == notebook


EXTRAS = {"usd": "usd-core", "models": "cmeel-assimp", "cad": "cascadio", "ray": "ray", "plot": "matplotlib"}


@pytest.mark.parametrize(("extra", "package"), EXTRAS.items())
def test_an_image_with_extras_has_what_was_tested(extra: str, package: str) -> None:
    """CI installs these locks into one environment, and so does an image: all have the same versions of what several
    of them need."""
    everything, lock, serve = (
        dict(re.findall(r"^([A-Za-z0-9_.-]+)==(\S+)", (ROOT / f"requirements{name}.lock").read_text(), re.MULTILINE))
        for name in ("", f".{extra}", ".serve")
    )
    assert package in lock and package not in serve and serve.items() <= lock.items()
    assert {name: everything.get(name, pin) for name, pin in lock.items()} == lock
    assert re.search(rf"[ |]{extra}[|)].*set -- ", (ROOT / "Dockerfile").read_text())
    assert f"!requirements.{extra}.lock" in (ROOT / ".dockerignore").read_text()
