"""Signatures of callbacks by Standard Webhooks (https://www.standardwebhooks.com), and the secret that makes them.

The scheme is five lines of HMAC; the package `standardwebhooks` is what the tests check them with.
"""

from __future__ import annotations

import base64
import hashlib
import hmac
import os
import secrets
import tempfile
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from service.callback_hosts import SECRET, secret_key
from service.config import Config
from service.problems import Unavailable

FILE = "callback.secret"  # in the data folder
KEY_BYTES = 32


def headers(id: str, timestamp: int, body: bytes, secrets: Sequence[str]) -> dict[str, str]:
    """Headers of one attempt, at `timestamp` s since 1970: a signature for each secret, so that one can replace
    another."""
    signed = f"{id}.{timestamp}.".encode() + body
    digests = (hmac.digest(secret_key(secret), signed, hashlib.sha256) for secret in secrets)
    signatures = " ".join(f"v1,{base64.b64encode(digest).decode()}" for digest in digests)
    return {"webhook-id": id, "webhook-timestamp": str(timestamp), "webhook-signature": signatures}


def secrets_of(config: Config) -> list[str]:
    """Those of SUNBOX_CALLBACK_SECRET, or the one of the data folder, which is made where there is none.

    Raises Unavailable where the disk fails.
    """
    return config.callback_secret or [_stored(config.data_dir)]


def _stored(folder: Path) -> str:
    path = folder / FILE
    try:
        if not path.exists():
            folder.mkdir(parents=True, exist_ok=True)
            number, part = tempfile.mkstemp(".tmp", ".callback-", folder)  # which nobody else may read
            with os.fdopen(number, "w") as file:
                file.write(SECRET + base64.b64encode(secrets.token_bytes(KEY_BYTES)).decode() + "\n")
                file.flush()
                os.fsync(file.fileno())
            with suppress(FileExistsError):  # another process was faster
                os.link(part, path)
            os.unlink(part)
        secret = path.read_text().strip()
        secret_key(secret)
    except OSError as error:
        raise Unavailable(f"The data folder cannot keep the secret of callbacks: {error.strerror}.", 60) from None
    except ValueError:
        raise Unavailable(f"{FILE} in the data folder is damaged; delete it, and receivers get a new one.") from None
    return secret
