"""Tables of OpenColorIO's views, baked from its exact processor when they are first asked for.

Against that processor, over colours of all saturations from 0.002 to 128 times white, an 8-bit picture under ACES 2.0
is off by 0.07 of its steps on average, by less than half a step in 99.9 % and at most by 2, near the borders of the
display's gamut; without a tone map at most by 6, where a colour begins to clip (tests/shaders/test_view_tables.py).
"""

from __future__ import annotations

import logging
import time
from collections import OrderedDict

import numpy as np

from gpu import GpuError, ViewTable
from service import displays

log = logging.getLogger(__name__)

NODES = 65
# Of the shaper: the linear light below which the nodes lie evenly, above it logarithmically; and the node that lies
# at 1. That of ACES 2.0 ends at 452, beyond which it is white. Views without a tone map clip at 1 and are steep at
# black.
ACES, PLAIN = (2.0**-6, 26), (2.0**-12, 40)
MOST = 4  # tables in memory, of 3 MB each

_baked: OrderedDict[tuple[str, str], ViewTable] = OrderedDict()


def view_table(display: str, view: str) -> ViewTable:
    """The table of a known view. Takes 0.3 s of a processor the first time."""
    key = display, view
    if key not in _baked:
        began = time.perf_counter()
        toe, node = ACES if view.startswith("ACES") else PLAIN
        top = toe * ((1.0 / toe + 1.0) ** ((NODES - 1) / node) - 1.0)
        axis = ViewTable.nodes(NODES, toe, top)
        blue, green, red = np.meshgrid(axis, axis, axis, indexing="ij")
        values = exact(np.stack([red, green, blue], axis=-1).reshape(NODES, -1, 3), display, view)
        values = np.clip(values, 0.0, 1.0).reshape(NODES, NODES, NODES, 3)
        _baked[key] = ViewTable(f"{display}/{view}", values, toe, top)
        log.info("baked a view", {"view": f"{display}/{view}", "ms": round((time.perf_counter() - began) * 1e3)})
    _baked.move_to_end(key)
    while len(_baked) > MOST:
        _baked.popitem(last=False)
    return _baked[key]


def exact(colors: np.ndarray, display: str, view: str) -> np.ndarray:
    """Display values of linear Rec.709 by OpenColorIO's own processor: (height, width, 3) float32, in and out."""
    import OpenImageIO as oiio

    height, width = colors.shape[:2]
    image = oiio.ImageBuf(oiio.ImageSpec(width, height, 3, "float"))
    image.set_pixels(image.roi, np.ascontiguousarray(colors, np.float32))
    out = oiio.ImageBufAlgo.ociodisplay(
        image, display, view, displays.SOURCE, unpremult=False, colorconfig=displays.CONFIGURATION, nthreads=1
    )
    if out.has_error:
        raise GpuError(f"OpenColorIO could not show {display}/{view}: {out.geterror()}")
    return np.asarray(out.get_pixels(oiio.FLOAT))
