"""Members that the requests for renders and batches share, for the API's description."""

from __future__ import annotations

from typing import Any

from service.callback_hosts import LONGEST_URL
from service.server.requests.request_parser import HIGHEST_PRIORITY, LONGEST_LABEL

NAMED: dict[str, Any] = {
    "label": {
        "type": ["string", "null"],
        "maxLength": LONGEST_LABEL,
        "default": None,
        "description": "A name to find renders by; several may have the same.",
    },
    "priority": {
        "type": "integer",
        "minimum": -HIGHEST_PRIORITY,
        "maximum": HIGHEST_PRIORITY,
        "default": 0,
        "description": "Of one's own renders that wait the highest starts first; nothing is interrupted.",
    },
    "callback": {
        "type": ["string", "null"],
        "maxLength": LONGEST_URL,
        "default": None,
        "description": "URL on a host of SUNBOX_CALLBACK_HOSTS that is sent the end, signed by Standard Webhooks.",
    },
}
