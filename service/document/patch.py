"""JSON merge patches."""

from __future__ import annotations

from typing import Any


def merge_patch(target: Any, patch: Any) -> Any:
    """`target` with `patch` merged in [RFC 7396]; neither is changed, and what did not change is shared.

    Beyond the RFC: a patch that changes an object's `type` replaces the object whole, because the fields of the old
    kind mean nothing to the new one.
    """
    if not isinstance(patch, dict):
        return patch
    merged = {} if not isinstance(target, dict) or _changes_type(target, patch) else dict(target)
    for key, value in patch.items():
        if value is None:
            merged.pop(key, None)
        else:
            merged[key] = merge_patch(merged.get(key), value)
    return merged


def _changes_type(target: dict[str, Any], patch: dict[str, Any]) -> bool:
    """Only texts and absence count: in a table of materials, "type" may be somebody's material."""
    if "type" not in patch:
        return False
    old, new = target.get("type"), patch["type"]
    return old != new and all(kind is None or isinstance(kind, str) for kind in (old, new))
