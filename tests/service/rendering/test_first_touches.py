"""Every slider of every built-in scene finds a kernel that was foreseen when the scene was shown."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

from gpu import KernelKey, RenderSettings, SceneArrays
from gpu.precompile import fallback, kernel_keys
from service.bench.scenes import BenchAssets
from service.config import Config
from service.document import presets
from service.ipc.messages import Update
from service.server.requests.request_reader import RequestReader
from service.server.streams import protocol
from service.server.streams.edit_session import EditSession
from service.worker.device.loaded_scene import EditedScene, KernelRequest, Offloaded, edited_scene, kernel_request
from tests.bench.sliders import Slider, sliders
from tests.marks import seldom

SETTINGS = {"width": 256, "height": 256}
SHARES = (0.0, 0.618, 1.0)  # of a slider's range: it is dragged to its ends, too
READER = RequestReader(Config(_env_file=None), BenchAssets())  # type: ignore[call-arg]


class Shown:
    """A scene as a stream edits it, and the scene's arrays and flags as its renderer has them."""

    def __init__(self, document: Any) -> None:
        self._session = EditSession(READER, 1)
        self._generation = 1
        start = protocol.Start(type="start", generation=1, scene=document, settings=SETTINGS)
        update = self._session.take(start) or self._session.pack_pending()
        assert update is not None and update.settings is not None
        self.settings = RenderSettings(**update.settings)
        self.loaded: Offloaded | None = None
        self._take(update)

    @property
    def arrays(self) -> SceneArrays:
        assert self.loaded is not None
        return self.loaded.arrays

    @property
    def packs(self) -> bool:
        return self._session.packs

    def _take(self, update: Update) -> EditedScene:
        self.whole = update.scene is not None  # the last update brought all arrays
        edited = edited_scene(update, self.loaded)
        assert edited is not None
        self.loaded = Offloaded(edited.arrays, self.settings, True, edited.flags, {})
        return edited

    def change(self, patch: Any) -> KernelRequest | None:
        """The kernel that the renderer asks for after a merge patch; None where it goes on with the one it has."""
        self._generation += 1
        message = protocol.Update(type="update", generation=self._generation, scene=patch)
        update = self._session.take(message) or self._session.pack_pending()
        if update is None:
            return None
        return kernel_request(update, self.settings, self._take(update), loaded=True)


# Sliders of rare and expensive features: the last picture stands while their kernel is compiled, but where they are
# the first ones touched.
RARE = {"film_thickness", "abbe", "diffuse_transmission", "ior", "thin_film_weight", "subsurface_weight"}


def foreseen(arrays: SceneArrays, settings: RenderSettings) -> tuple[set[KernelKey], frozenset[str]]:
    """The keys that are compiled once a stream shows the scene, and the flags of its superset kernels."""
    superset = fallback.superset(arrays)
    own = kernel_keys.kernel_key(arrays, settings, kernel_keys.flags(arrays, True))
    later = kernel_keys.keys_after_edit(arrays, settings)
    return {own, *later, *fallback.superset_keys(arrays, settings, superset)}, superset


def touches(document: Any) -> Iterator[tuple[Slider, KernelRequest, RenderSettings]]:
    """What is asked for when one slider after the other is touched, and brought back."""
    shown = Shown(document)
    for slider in sliders(document):
        for share in SHARES:
            request = shown.change(slider.patch(document, share))
            if request is not None:
                yield slider, request, shown.settings
        shown.change(slider.restore(document))


@pytest.mark.parametrize(("name", "more"), [("film_thickness", {}), ("abbe", {"transmission": 1})])
def test_a_rare_slider_is_foreseen_as_the_first(name: str, more: dict[str, Any]) -> None:
    document = presets.get("scenes", "sphere-on-floor")
    document["materials"]["Red paint"] = {"type": "principled", **more}
    first = Shown(document)
    (slider,) = (each for each in sliders(document) if each.name == f"materials/Red paint/{name}")
    keys, _ = foreseen(first.arrays, first.settings)
    asked = [request for share in SHARES if (request := first.change(slider.patch(document, share)))]
    assert asked and all(request.key in keys for request in asked)


NAMES = [entry["name"] for entry in presets.names("scenes")]
# One for each of the families of materials, environments and lamps.
OFTEN = {
    "armchair",
    "cornell-glossy",
    "disney-grid",
    "fog",
    "point-lights",
    "sphere-on-floor",
    "sphere-field",
    "watch",
}


@pytest.mark.parametrize("name", seldom(NAMES, set(NAMES) - OFTEN))
def test_every_slider_is_foreseen(name: str) -> None:
    document = presets.get("scenes", name)
    first = Shown(document)
    keys, superset = foreseen(first.arrays, first.settings)
    late = {
        slider.name
        for slider, request, settings in touches(document)
        if request.key not in keys and fallback.kernel_key(request.arrays, request.settings, superset) not in keys
    }
    assert {name.rpartition("/")[2] for name in late} <= RARE


@pytest.mark.parametrize("name", [entry["name"] for entry in presets.names("scenes")])
def test_sliders_of_the_environment_send_no_shapes(name: str) -> None:
    document = presets.get("scenes", name)
    shown, whole = Shown(document), set()
    for slider in sliders(document):
        if slider.path[0] == "environment":
            for share in (0.1, 0.618, 0.9):
                shown.change(slider.patch(document, share))
                whole |= {slider.name} if shown.whole else set()
    assert whole == set()


def test_only_what_is_packed_holds_the_picture() -> None:
    shown, packs = Shown(presets.get("scenes", "sphere-on-floor")), {}
    for slider in sliders(presets.get("scenes", "sphere-on-floor")):
        shown.change(slider.patch(presets.get("scenes", "sphere-on-floor"), 0.618))
        packs[slider.name] = shown.packs
    assert packs["environment/blur"] and packs["materials/Red paint/emission"]
    assert not any(packs[name] for name in ("camera/vfov", "environment/rotation", "materials/Red paint/roughness"))


def test_a_superset_kernel_depends_on_no_light() -> None:
    """Else one would have to be compiled for each lamp that somebody may turn on."""
    document = presets.get("scenes", "point-lights")
    shown = Shown(document)
    superset = fallback.superset(shown.arrays)
    before = fallback.kernel_key(shown.arrays, shown.settings, superset)
    for patch in ({"materials": {"Ochre paint": {"emission": 2.0}}}, {"lights": document["lights"][:1]}):
        request = shown.change(patch)
        assert request is not None and fallback.kernel_key(request.arrays, request.settings, superset) == before


def test_what_a_superset_kernel_does_not_show() -> None:
    shown = Shown(presets.get("scenes", "cornell-boxes"))
    superset = fallback.superset(shown.arrays)
    other = Shown(presets.get("scenes", "sphere-on-floor"))
    assert fallback.kernel_key(other.arrays, other.settings, superset) is None
