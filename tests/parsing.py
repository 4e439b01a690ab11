"""Children that parse, for tests that look at one over many broken files."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from service.formats.sandbox import sandbox
from service.system.child_processes import Child


@contextmanager
def one_child() -> Iterator[None]:
    """A child goes on after an error: that it was never replaced shows that no file crashed it, or had it killed."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sandbox, "FILES", 1_000_000)
        patch.setattr(Child, "is_spent", property(lambda self: False, lambda self, value: None), raising=False)
        yield
