"""A frame of a stream: a picture on its way to the true one."""

from __future__ import annotations

import json
import struct
from dataclasses import dataclass
from io import BytesIO
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import numpy as np
    from PIL.Image import Image

RAW = "application/octet-stream"
_LENGTH = struct.Struct("<I")


@dataclass(frozen=True)
class Frame:
    """`samples` a pixel; `noise` is the estimated RMSE of the luminance over its mean, None before 2 samples; `scale`
    is below 1 where the picture is traced with fewer pixels at first; `data` are `mime`'s bytes."""

    generation: int
    seq: int
    samples: int
    width: int
    height: int
    mime: str
    noise: float | None
    elapsed_s: float
    eta_s: float | None
    scale: float
    data: bytes

    def numpy(self) -> np.ndarray[Any, Any]:
        """(height, width, 4) linear float32, premultiplied, of `rgba32f`; (height, width, 3 or 4) uint8 in sRGB of
        the other formats. Row 0 is the top."""
        import numpy as np

        if self.mime == RAW:
            return np.frombuffer(self.data, "<f4").reshape(self.height, self.width, 4)
        return np.asarray(self.image())

    def image(self) -> Image:
        """As a Pillow image. Raises ValueError for `rgba32f`, whose pixels are not those of a screen."""
        from PIL import Image

        if self.mime == RAW:
            raise ValueError("rgba32f has no screen's colours: ask the stream for format='png', or take numpy()")
        return Image.open(BytesIO(self.data))


def parse(message: bytes) -> Frame:
    """The frame in a binary message: the header's length, the header, the bytes of the image."""
    (length,) = _LENGTH.unpack_from(message)
    header = json.loads(message[_LENGTH.size : _LENGTH.size + length])
    known = {name: header.get(name) for name in Frame.__dataclass_fields__ if name != "data"}
    return Frame(**known, data=message[_LENGTH.size + length :])
