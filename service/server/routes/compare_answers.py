"""What a comparison takes and answers, for the API's description."""

from __future__ import annotations

from pydantic import BaseModel, Field

from service.server.requests.compare_request import CONFIDENCE
from service.server.routes.answers import RENDER_SCHEMA, body
from service.server.routes.examples import COMPARISON
from service.server.verdict.figures import Differing
from service.server.verdict.regions import Region


class UnderWay(BaseModel):
    samples: int = Field(description="Of each pixel, that are taken.")
    max_samples: int = Field(description="That are taken at most: fewer, once they are known to differ.")


class SamplesTaken(BaseModel):
    a: int
    b: int


class Verdict(BaseModel):
    different: bool = Field(description="Whether `p_value` is below 1 - `confidence`.")
    p_value: float = Field(
        description="Two pictures of equal expectation seem to differ as much by noise at most so often. It is "
        "corrected for every pixel, region, channel and look."
    )
    mean_difference: float = Field(description="The mean of b - a, linear luminance.")
    rmse: float = Field(description="Linear luminance, noise included.")
    psnr: float | None = Field(description="dB, of sRGB as displayed over black; null where the pictures are equal.")
    flip: float = Field(description="Mean LDR-FLIP at 67 pixels a degree, as displayed: 0 to 1.")
    ssim: float = Field(description="Mean SSIM of grey as displayed; 1 where the pictures are equal.")
    differing: Differing
    samples: SamplesTaken = Field(
        description="Of each pixel, when the verdict was known; 0 where both are one document, which needs none."
    )
    regions: list[Region] = Field(description="Where they differ, the most certain first; at most 64.")


_SIDE = {
    "anyOf": [RENDER_SCHEMA, {"type": "string"}],
    "description": "A document; or the id of a render, or `sha256:...` of an EXR that was written with every layer.",
}
BODY = body(
    {
        "type": "object",
        "required": ["a", "b"],
        "additionalProperties": False,
        "properties": {
            "a": _SIDE,
            "b": _SIDE,
            "confidence": {
                "type": "number",
                "exclusiveMinimum": 0,
                "exclusiveMaximum": 1,
                "default": CONFIDENCE,
                "description": "False alarms come at 1 - `confidence` or less.",
            },
        },
    },
    roughness=COMPARISON,
)
