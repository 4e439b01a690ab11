"""`sunbox`, whose server does nothing ahead of its first client: `python -m tests.unwarmed serve`.

A start compiles kernels and loads builders while nobody asks for anything, 1.7 s of a core. Tests that start several
servers, and look at none of that, leave it out.
"""

from __future__ import annotations

import sys
from typing import Any

from service import app
from service.cli import main


async def _nothing(*given: Any) -> None: ...


if __name__ == "__main__":
    app.warm_up = _nothing
    sys.exit(main())
