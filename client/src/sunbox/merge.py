"""Merge patches: RFC 7386 with one rule more, which the service has, too."""

from __future__ import annotations

from typing import Any


def merged(target: Any, patch: Any) -> Any:
    """`target` with `patch`; neither is changed. Null takes a member away, arrays are replaced whole, and a patch
    that changes an object's `type` replaces that object: a sphere's radius means nothing to a box."""
    if not isinstance(patch, dict):
        return patch
    is_other = isinstance(target, dict) and _changes_type(target, patch)
    result = dict(target) if isinstance(target, dict) and not is_other else {}
    for name, value in patch.items():
        if value is None:
            result.pop(name, None)
        else:
            result[name] = merged(result.get(name), value)
    return result


def _changes_type(target: dict[str, Any], patch: dict[str, Any]) -> bool:
    """Only texts and absence count: in a table of materials, "type" may be somebody's material."""
    old, new = target.get("type"), patch.get("type")
    return "type" in patch and old != new and all(kind is None or isinstance(kind, str) for kind in (old, new))
