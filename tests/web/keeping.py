"""`sunbox`, of whose page a browser keeps the files for an hour: `python -m tests.web.keeping -m service.cli serve`.

The service has a browser ask for each of the 150 files whether there is a newer one, whenever the page is opened. For
tests that open it anew again and again that is two fifths of the work.
"""

from __future__ import annotations

import sys
from typing import Any

from starlette.responses import Response

from service.cli.program import main
from service.server.routes.errors import Files

_answer = Files.get_response


async def _keepable(self: Files, *given: Any) -> Response:
    response = await _answer(self, *given)
    response.headers["cache-control"] = "max-age=3600"
    return response


if __name__ == "__main__":
    Files.get_response = _keepable  # type: ignore[method-assign]
    del sys.argv[1:3]  # the module in whose place this one is started
    sys.exit(main())
