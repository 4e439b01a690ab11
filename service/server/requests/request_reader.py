"""A caller's documents become packed scenes, with the service's limits and assets. Not for the event loop."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from service.config import Config
from service.document import Material, Scene
from service.document.quality import ResolvedSettings
from service.formats.cache import AnyAssets, as_lut
from service.ipc.messages import Lut, SceneData, StopRule
from service.pack import CacheBudget, PackCache, Packed, lone_material, pack, pack_material
from service.problems import AssetError, FieldError, InvalidDocument, NotFound
from service.server.requests.request_parser import RequestParser
from service.server.storage.asset_access import AssetAccess
from service.system.memory import Limit, MemoryBudget, work

# That renders share: the tables of a map of 512 x 256 texels take 70 ms to make, those of a MERL file 200 ms.
SHARED = 4
BATCHES_PART = 4  # of SUNBOX_MEMORY, a part that the documents of batches may take


class RequestReader(RequestParser):
    """Raises InvalidDocument with pointers from the root of the body: /scene/..., /settings/..."""

    def __init__(
        self, config: Config, assets: AnyAssets, memory: MemoryBudget | None = None, access: AssetAccess | None = None
    ) -> None:
        """`access` says which assets an owner may use; without it each may use all."""
        super().__init__(config)
        self.memory = memory or MemoryBudget(config.memory)
        # For documents as JSON values, which merge patches could make ever larger.
        what = "scenes of streams (SUNBOX_MAX_STREAM_MEMORY)"
        self.stream_memory = Limit("documents", config.max_stream_memory, what)
        most = self.memory.limit // BATCHES_PART
        self.batch_memory = Limit("documents", most, "documents of batches under way (SUNBOX_MEMORY)")
        self.caches = CacheBudget(config.keep_packed)
        self.memory.cache("scenes", lambda: self.caches.bytes, self.caches.shrink)
        self._assets = assets
        self._access = access
        self._shared = PackCache(SHARED, self.caches)

    def pack(
        self, scene: Scene, cache: PackCache | None = None, *, owner: str, hold: Callable[[int], None] | None = None
    ) -> Packed:
        """`owner`: whose assets the scene may use; "": all, for scenes of the server itself and without keys.

        `hold` is called with the bytes that packing takes, before it takes them; by default they count on their own.
        The packed scene counts in the memory until it is garbage, or until its next owner releases it there. Raises
        TooLarge, Unavailable as well.
        """
        assets = self._assets if self._access is None else self._access.view(owner, scene)
        with _under("/scene"), self.memory.growing("scenes") as counted, work(hold or counted):
            packed = pack(scene, assets, cache, self._config, self._shared)
            self.memory.count("scenes", packed, packed.bytes)
            return packed

    def pack_material(self, material: Material, *, owner: str) -> SceneData:
        """The same for one material, which has no textures; pointers begin with /material."""
        assets = self._assets if self._access is None else self._access.view(owner, lone_material(material))
        with _under("/material"):
            return pack_material(material, assets, self._config, self._shared)

    def lut(self, id: str, *, owner: str) -> Lut:
        """A table of displayed colours, which `owner` may use. Raises InvalidDocument."""
        try:
            if self._access is not None:
                self._access.check(owner, id)
            found = as_lut(self._assets.load(id), id)
        except (AssetError, NotFound) as error:
            raise InvalidDocument([FieldError("/lut", error.detail)]) from None
        return Lut(id, found.values, found.low, found.high)


def stop_rule(settings: ResolvedSettings) -> StopRule:
    return StopRule(settings.max_samples, settings.time_limit, settings.target_noise)


@contextmanager
def _under(pointer: str) -> Iterator[None]:
    try:
        yield
    except InvalidDocument as error:
        raise error.under(pointer) from None
