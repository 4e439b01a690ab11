"""Machine code for the few loops that numpy cannot express, cached in the user's folder between runs."""

from __future__ import annotations

import functools
import logging
import os
import sys
from collections.abc import Callable
from hashlib import sha256
from pathlib import Path
from typing import Any, TypeVar, cast


def _cache() -> Path:
    """A folder in the user's cache, as the package's own may be read-only; its name changes whenever the code does.

    numba alone would miss a change in a function or constant that comes from another file.
    """
    folder = Path(__file__).parent
    names = ("accel/*.py", "layout/*.py", "tables/build/*.py", "tables/mip_levels.py")
    sources = [source for name in names for source in sorted(folder.glob(name))]
    digest = sha256(b"".join(source.read_bytes() for source in sources)).hexdigest()
    home = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    return home / "sunbox" / "numba" / digest[:16]


os.environ.setdefault("NUMBA_CACHE_DIR", str(_cache()))

import numba  # noqa: E402

# numba looks for BLAS in scipy, which takes 0.15 s when the first loop starts; no loop here multiplies matrices.
_BLAS = "scipy.linalg.cython_blas"
if _BLAS not in sys.modules:
    sys.modules[_BLAS] = cast(Any, None)  # importing it fails at once
    import numba.np.arraymath

    del sys.modules[_BLAS]

log = logging.getLogger(__name__)

F = TypeVar("F", bound=Callable[..., Any])


def jit(function: F) -> F:
    """`function`, compiled at its first call and run without the GIL.

    Where no cache can be written, each process compiles it anew.
    """
    return _compiled(function)


def jit_loose(function: F) -> F:
    """As `jit`, twice as fast for long sums: dividing by zero gives infinity, terms come in any order."""
    return _compiled(function, fastmath=True, error_model="numpy")


def _compiled(function: F, **options: Any) -> F:
    try:
        return cast(F, numba.njit(cache=True, nogil=True, **options)(function))
    except RuntimeError:
        _log_no_cache()
        return cast(F, numba.njit(nogil=True, **options)(function))


@functools.cache
def _log_no_cache() -> None:
    folder = os.environ["NUMBA_CACHE_DIR"]
    log.warning("machine code is compiled anew in each process, as its cache cannot be written", {"folder": folder})
