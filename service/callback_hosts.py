"""An operator's rules for callbacks: to which hosts they go, which addresses these may have, and what signs them."""

from __future__ import annotations

import base64
import ipaddress
import re
from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple
from urllib.parse import urlsplit

SECRET = "whsec_"  # how secrets begin
LONGEST_URL = 2000  # characters
PORTS = {"https": 443, "http": 80}
NAT64 = ipaddress.ip_network("64:ff9b::/96")  # addresses that end in the IPv4 address which is reached [RFC 6052]
GLOBAL_UNICAST = ipaddress.ip_network("2000::/3")  # all of IPv6 that is given to public hosts

Address = ipaddress.IPv4Address | ipaddress.IPv6Address
Network = ipaddress.IPv4Network | ipaddress.IPv6Network
_ENTRY = re.compile(r"(?:(https?)://)?([A-Za-z0-9._-]+|\[[0-9A-Fa-f:.]+\])(?::([0-9]{1,5}))?/?")
_PRINTABLE = re.compile(r"[!-~]+")  # no blanks, no control characters, nothing that needs an encoding


class Origin(NamedTuple):
    """Where a callback is sent. IPv6 addresses are without brackets."""

    scheme: str
    host: str
    port: int

    def __str__(self) -> str:
        """As in the header `Host`."""
        host = f"[{self.host}]" if ":" in self.host else self.host
        return host if self.port == PORTS[self.scheme] else f"{host}:{self.port}"


@dataclass(frozen=True)
class CallbackHosts:
    """The origins that are named, and the networks in which the addresses of hosts may lie besides public ones."""

    origins: frozenset[Origin] = frozenset()
    networks: tuple[Network, ...] = ()

    @staticmethod
    def parse(entries: Iterable[str]) -> CallbackHosts:
        """Raises ValueError, whose text is for the operator."""
        origins, networks = set[Origin](), list[Network]()
        for entry in entries:
            if re.fullmatch(r"[0-9A-Fa-f:.]+/[0-9]{1,3}", entry):
                networks.append(ipaddress.ip_network(entry, strict=False))
                continue
            origins.add(origin := _named(entry))
            if (address := _literal(origin.host)) is not None:  # which is named by that
                networks.append(ipaddress.ip_network(address))
        return CallbackHosts(frozenset(origins), tuple(networks))

    def origin(self, url: str) -> Origin:
        """Where that callback would go. Raises ValueError, whose text is for the caller."""
        if not self.origins:
            raise ValueError("this server sends no callbacks; its operator names the hosts in SUNBOX_CALLBACK_HOSTS")
        found, parts = origin_of(url), urlsplit(url)
        if not found.host or not _PRINTABLE.fullmatch(url) or "\\" in url:
            raise ValueError("must be an https URL, with what is not ASCII percent-encoded")
        if parts.username is not None or parts.password is not None:
            raise ValueError("must have no user name and password")
        if found not in self.origins:
            raise ValueError(f"{found.scheme}://{found} is none of the hosts that SUNBOX_CALLBACK_HOSTS names")
        return found

    def allows(self, address: Address) -> bool:
        """True if callbacks may go to that address: a public one, or one of a network that is named."""
        if any(address in network for network in self.networks if network.version == address.version):
            return True
        inner = _embedded(address)
        if inner is not None:
            return self.allows(inner)
        unicast = address.version == 4 or address in GLOBAL_UNICAST
        return unicast and address.is_global and not address.is_multicast


def origin_of(url: str) -> Origin:
    """Where a URL leads, however its host and port are written. Raises ValueError, whose text is for the caller."""
    try:
        parts = urlsplit(url)
        return Origin(parts.scheme, (parts.hostname or "").rstrip("."), parts.port or PORTS[parts.scheme])
    except (ValueError, KeyError):
        raise ValueError("must be an https URL") from None


def secret_key(secret: str) -> bytes:
    """The bytes of a secret, as Standard Webhooks write it. Raises ValueError, which does not repeat it."""
    try:
        key = base64.b64decode(secret.removeprefix(SECRET) if secret.startswith(SECRET) else "", validate=True)
    except ValueError:
        key = b""
    if not 24 <= len(key) <= 64:
        raise ValueError(f"a secret is {SECRET} and 24 to 64 bytes in base64, as `sunbox callback-secret` prints one")
    return key


def checked_hosts(entries: list[str]) -> list[str]:
    """The same. Raises ValueError."""
    CallbackHosts.parse(entries)
    return entries


def checked_secrets(secrets: list[str]) -> list[str]:
    """The same. Raises ValueError."""
    for secret in secrets:
        secret_key(secret)
    return secrets


def _named(entry: str) -> Origin:
    found = _ENTRY.fullmatch(entry)
    if found is None:
        raise ValueError(
            f"{entry!r} is neither a host, as hooks.example.org, hooks.example.org:8443 or http://10.0.0.5:8080, "
            "nor a network, as 10.0.0.0/8"
        )
    scheme, host, port = found[1] or "https", found[2].strip("[]").rstrip(".").lower(), int(found[3] or 0)
    if port > 65535:
        raise ValueError(f"{entry!r} has no port of a host: they end at 65535")
    return Origin(scheme, host, port or PORTS[scheme])


def _literal(host: str) -> Address | None:
    try:
        return ipaddress.ip_address(host)
    except ValueError:
        return None


def _embedded(address: Address) -> ipaddress.IPv4Address | None:
    """The IPv4 address that packets to an IPv6 address may reach."""
    if not isinstance(address, ipaddress.IPv6Address):
        return None
    if address in NAT64:
        return ipaddress.IPv4Address(int(address) & 0xFFFFFFFF)
    return address.ipv4_mapped or address.sixtofour
