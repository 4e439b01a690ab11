"""Where callbacks go: hosts that are named, addresses that are public or named, and nowhere else."""

from __future__ import annotations

import asyncio
import ipaddress
import socket
import ssl
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from service.callback_hosts import CallbackHosts
from service.config import ConfigError, load_config
from service.server.callbacks import posting
from tests.service.receiving import Receiver


@pytest.fixture
def receiver() -> Iterator[Receiver]:
    receiver = Receiver()
    yield receiver
    receiver.close()


@pytest.mark.parametrize(
    ("entries", "allowed", "forbidden"),
    [
        (
            ["hooks.example.org"],
            "8.8.8.8 2606:4700::1111 64:ff9b::808:808",
            "127.0.0.1 10.0.0.6 169.254.169.254 100.64.0.1 0.0.0.0 224.0.0.1 224.0.1.5 255.255.255.255 192.0.2.1 "
            "::1 fe80::1 fc00::1 fec0::1 ff0e::1 ::ffff:10.0.0.6 ::127.0.0.1 64:ff9b::a00:6 64:ff9b:1::a00:6 "
            "2002:a00:6::",
        ),
        (["hooks.example.org", "10.0.0.0/8"], "10.0.0.6 ::ffff:10.0.0.6 64:ff9b::a00:6", "127.0.0.1"),
        (["http://10.0.0.5:8080", "[::1]:8443"], "10.0.0.5 ::1", "10.0.0.6 ::2"),
    ],
)
def test_which_addresses_may_be_called(entries: list[str], allowed: str, forbidden: str) -> None:
    hosts = CallbackHosts.parse(entries)
    assert all(hosts.allows(ipaddress.ip_address(each)) for each in allowed.split())
    assert not any(hosts.allows(ipaddress.ip_address(each)) for each in forbidden.split())


@pytest.mark.parametrize("entry", ["a b", "https://a/path", "a:99999", "10.0.0.0/99", "ftp://a", "*.example.org"])
def test_an_operator_s_mistake_ends_the_start(entry: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SUNBOX_CALLBACK_HOSTS", entry)
    with pytest.raises(ConfigError, match="SUNBOX_CALLBACK_HOSTS"):
        load_config()
    monkeypatch.delenv("SUNBOX_CALLBACK_HOSTS")
    monkeypatch.setenv("SUNBOX_CALLBACK_SECRET", "whsec_c2hvcnQ=")
    with pytest.raises(ConfigError, match="24 to 64 bytes") as refused:
        load_config()
    assert "c2hvcnQ" not in str(refused.value)


def answers_with(monkeypatch: pytest.MonkeyPatch, *addresses: str) -> list[str]:
    """The hosts that were looked up; each time they have the next address, and at last the last one."""
    asked, left = list[str](), list(addresses)

    def look_up(host: str, port: int, **more: Any) -> Any:
        asked.append(host)
        address = left.pop(0) if len(left) > 1 else left[0]
        return [(socket.AF_INET, socket.SOCK_STREAM, 6, "", (address, port))]

    monkeypatch.setattr(posting.socket, "getaddrinfo", look_up)
    return asked


def post(url: str, hosts: CallbackHosts, context: ssl.SSLContext | None = None) -> int:
    return asyncio.run(posting.post(url, b"{}", {"webhook-id": "a"}, hosts, context or posting.tls()))


def test_a_name_with_a_private_address_is_not_called(receiver: Receiver, monkeypatch: pytest.MonkeyPatch) -> None:
    hosts = CallbackHosts.parse([f"http://inner.example:{receiver.port}"])
    answers_with(monkeypatch, "127.0.0.1")
    with pytest.raises(posting.NotSent, match="not public"):
        post(f"http://inner.example:{receiver.port}/", hosts)
    assert not receiver.heard


def test_rebinding_gains_nothing(receiver: Receiver, monkeypatch: pytest.MonkeyPatch) -> None:
    """The name is looked up once, and what was checked is what is connected to."""
    hosts = CallbackHosts.parse([f"http://inner.example:{receiver.port}", "127.0.0.1/32"])
    asked = answers_with(monkeypatch, "127.0.0.1", "127.0.0.2")
    assert post(f"http://inner.example:{receiver.port}/", hosts) == 204
    assert asked == ["inner.example"] and receiver.heard[0].headers["host"] == f"inner.example:{receiver.port}"


def test_a_host_with_several_addresses_is_called_at_one_that_is_allowed(
    receiver: Receiver, monkeypatch: pytest.MonkeyPatch
) -> None:
    hosts = CallbackHosts.parse([f"http://inner.example:{receiver.port}", "127.0.0.0/30"])
    addresses = ["127.0.0.9", "127.0.0.2", "127.0.0.1"]  # forbidden, nobody listens, the receiver
    found = [(socket.AF_INET, socket.SOCK_STREAM, 6, "", (each, receiver.port)) for each in addresses]
    monkeypatch.setattr(posting.socket, "getaddrinfo", lambda *arguments, **more: found)
    assert post(f"http://inner.example:{receiver.port}/", hosts) == 204


@pytest.mark.parametrize("name", ["hooks.example", "other.example"])
def test_the_certificate_is_checked_against_the_name(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    key, certificate = tmp_path / "key.pem", tmp_path / "certificate.pem"
    command = f"openssl req -x509 -newkey rsa:2048 -nodes -keyout {key} -out {certificate} -days 2 -subj /CN=test"
    alternative = "subjectAltName=DNS:hooks.example"
    subprocess.run([*command.split(), "-addext", alternative], check=True, capture_output=True)
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.load_cert_chain(certificate, key)
    receiver = Receiver(context)
    hosts = CallbackHosts.parse([f"{name}:{receiver.port}", "127.0.0.1/32"])
    answers_with(monkeypatch, "127.0.0.1")
    trusting = ssl.create_default_context(cafile=certificate)
    try:
        if name == "hooks.example":
            assert post(f"https://{name}:{receiver.port}/", hosts, trusting) == 204
        with pytest.raises(posting.NotSent, match="certificate verify failed"):
            post(f"https://{name}:{receiver.port}/", hosts, trusting if name == "other.example" else None)
    finally:
        receiver.close()
