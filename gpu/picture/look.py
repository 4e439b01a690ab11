"""How a picture's colour is shown: exposure, curve or table of a display, primaries, and a table applied last."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

IN_P3, THEN_P3 = 1, 2  # values of GAMUT: the curve runs in the primaries of P3; or its result is converted to them
FITTED = ("aces", "agx")  # curves whose matrices were fitted for Rec.709, in which they run whatever the display is


@dataclass(frozen=True)
class ViewTable:
    """Display values over linear Rec.709, which takes the place of a curve and of the sRGB encoding.

    The nodes lie evenly over log2(c / toe + 1) from c = 0 to `top`, where it ends; between them it is interpolated in
    tetrahedra. `key` is equal where the tables are."""

    key: str
    values: np.ndarray  # (n, n, n, 3) float32 in 0..1, by blue, green and red
    toe: float
    top: float

    @staticmethod
    def nodes(count: int, toe: float, top: float) -> np.ndarray:
        """The linear values at the nodes of an axis."""
        return toe * (np.exp2(np.linspace(0.0, np.log2(top / toe + 1.0), count)) - 1.0)


@dataclass(frozen=True)
class Lut:
    """A table from display values to display values. Outside its domain the values at its border hold."""

    key: str
    values: np.ndarray  # (n, 3) float32, a curve for each channel; or (n, n, n, 3), by blue, green and red
    low: tuple[float, float, float] = (0.0, 0.0, 0.0)
    high: tuple[float, float, float] = (1.0, 1.0, 1.0)


@dataclass(frozen=True)
class Look:
    """`exposure` is in stops. `p3` gives values in Display P3 instead of sRGB; a `ViewTable` has its own display,
    whatever `p3` is."""

    exposure: float = 0.0
    tone_map: str | ViewTable = "pbr_neutral"
    p3: bool = False
    lut: Lut | None = None

    @property
    def defines(self) -> dict[str, object]:
        """The defines that resolve.comp is compiled with."""
        table = isinstance(self.tone_map, ViewTable)
        curve = "linear" if table else self.tone_map
        gamut = 0 if table or not self.p3 else THEN_P3 if self.tone_map in FITTED else IN_P3
        lut = 0 if self.lut is None else 1 if self.lut.values.ndim == 2 else 3
        return {"TONE_MAP": f"{curve}_curve", "VIEW_TABLE": int(table), "GAMUT": gamut, "LUT_AXES": lut}

    @property
    def key(self) -> str:
        """The key of `texels`, equal where they are; empty where there are none."""
        view = self.tone_map.key if isinstance(self.tone_map, ViewTable) else ""
        lut = self.lut.key if self.lut else ""
        return f"{view}|{lut}" if view or lut else ""

    def texels(self) -> np.ndarray:
        """The texels of both tables, the display's first: (n, 4) float32."""
        tables = [self.tone_map.values] if isinstance(self.tone_map, ViewTable) else []
        tables += [self.lut.values] if self.lut else []
        flat = [np.asarray(table, np.float32).reshape(-1, 3) for table in tables]
        return np.pad(np.concatenate(flat), ((0, 0), (0, 1)))

    def set_uniforms(self, kernel: object) -> None:
        """Set the uniforms that the kernel of `defines` reads."""
        uniforms: dict[str, object] = {"exposure": 2.0**self.exposure}
        first = 0
        if isinstance(self.tone_map, ViewTable):
            side = len(self.tone_map.values)
            first = side**3
            uniforms |= {"view_side": side, "view_toe": self.tone_map.toe, "view_top": self.tone_map.top}
        if self.lut is not None:
            span = np.maximum(np.subtract(self.lut.high, self.lut.low), 1e-6)
            uniforms |= {"lut_first": first, "lut_side": len(self.lut.values)}
            uniforms |= {"lut_low": self.lut.low, "lut_scale": tuple((1.0 / span).tolist())}
        for name, value in uniforms.items():
            kernel[name].value = value  # type: ignore[index]
