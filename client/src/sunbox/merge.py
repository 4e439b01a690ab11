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


def difference(old: Any, new: Any) -> Any:
    """The patch that leads from one document to another; None where they are equal. Neither holds a null."""
    if old == new:
        return None
    if not isinstance(old, dict) or not isinstance(new, dict) or ("type" in new and _changes_type(old, new)):
        return new
    patch: dict[str, Any] = {name: None for name in old if name not in new}
    for name, value in new.items():
        if name not in old:
            patch[name] = value
        elif (change := difference(old[name], value)) is not None:
            patch[name] = change
    return patch


def _changes_type(target: dict[str, Any], patch: dict[str, Any]) -> bool:
    """Only texts and absence count: in a table of materials, "type" may be somebody's material."""
    old, new = target.get("type"), patch.get("type")
    return "type" in patch and old != new and all(kind is None or isinstance(kind, str) for kind in (old, new))
