"""Merge patches: the examples of RFC 7396, and the rule on a changed `type`."""

from __future__ import annotations

import copy
from typing import Any

import pytest

from service.document import merge_patch

RFC_7396_APPENDIX_A: list[tuple[Any, Any, Any]] = [
    ({"a": "b"}, {"a": "c"}, {"a": "c"}),
    ({"a": "b"}, {"b": "c"}, {"a": "b", "b": "c"}),
    ({"a": "b"}, {"a": None}, {}),
    ({"a": "b", "b": "c"}, {"a": None}, {"b": "c"}),
    ({"a": ["b"]}, {"a": "c"}, {"a": "c"}),
    ({"a": "c"}, {"a": ["b"]}, {"a": ["b"]}),
    ({"a": {"b": "c"}}, {"a": {"b": "d", "c": None}}, {"a": {"b": "d"}}),
    ({"a": [{"b": "c"}]}, {"a": [1]}, {"a": [1]}),
    (["a", "b"], ["c", "d"], ["c", "d"]),
    ({"a": "b"}, ["c"], ["c"]),
    ({"a": "foo"}, None, None),
    ({"a": "foo"}, "bar", "bar"),
    ({"e": None}, {"a": 1}, {"e": None, "a": 1}),
    ([1, 2], {"a": "b", "c": None}, {"a": "b"}),
    ({}, {"a": {"bb": {"ccc": None}}}, {"a": {"bb": {}}}),
]

DISNEY = {"type": "disney", "roughness": 0.3, "emission": 1}
CHANGED_TYPES: list[tuple[Any, Any, Any]] = [
    # the fields of the old kind go
    ({"m": DISNEY}, {"m": {"type": "diffuse", "albedo": 0.5}}, {"m": {"type": "diffuse", "albedo": 0.5}}),
    # the same type said again changes nothing
    ({"m": DISNEY}, {"m": {"type": "disney", "roughness": 1}}, {"m": {**DISNEY, "roughness": 1}}),
    # a type where there was none, and none where there was one: two kinds too
    ({"t": {"asset": "a"}}, {"t": {"type": "checker", "a": 1}}, {"t": {"type": "checker", "a": 1}}),
    ({"t": {"type": "checker", "a": 1}}, {"t": {"type": None, "asset": "a"}}, {"t": {"asset": "a"}}),
    # somebody's material named "type"
    ({"ms": {"type": DISNEY}}, {"ms": {"type": {"roughness": 1}}}, {"ms": {"type": {**DISNEY, "roughness": 1}}}),
    ({"ms": {"type": DISNEY, "b": 1}}, {"ms": {"type": None}}, {"ms": {"b": 1}}),
    ({"ms": {"b": 1}}, {"ms": {"type": DISNEY}}, {"ms": {"b": 1, "type": DISNEY}}),
]


@pytest.mark.parametrize(("target", "patch", "expected"), RFC_7396_APPENDIX_A + CHANGED_TYPES)
def test_merge(target: Any, patch: Any, expected: Any) -> None:
    before = copy.deepcopy((target, patch))
    assert merge_patch(target, patch) == expected
    assert (target, patch) == before


def test_what_did_not_change_is_shared() -> None:
    target = {"shapes": [{"type": "sphere"}] * 3, "camera": {"vfov": 40}}
    merged = merge_patch(target, {"camera": {"vfov": 50}})
    assert merged["shapes"] is target["shapes"] and merged["camera"] is not target["camera"]
