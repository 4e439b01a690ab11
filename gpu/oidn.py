"""Open Image Denoise on the GPU that renders, by the library's parts for CUDA, HIP and SYCL."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from gpu.egl import Device

KINDS = {2: "SYCL", 3: "CUDA", 4: "HIP"}  # OIDNDeviceType of oidn.h
# What oidn.h 2.5 has and pyoidn does not declare.
DECLARATIONS = """
int oidnGetNumPhysicalDevices();
bool oidnGetPhysicalDeviceBool(int physicalDeviceID, const char* name);
int oidnGetPhysicalDeviceInt(int physicalDeviceID, const char* name);
const char* oidnGetPhysicalDeviceString(int physicalDeviceID, const char* name);
const void* oidnGetPhysicalDeviceData(int physicalDeviceID, const char* name, size_t* byteSize);
OIDNDevice oidnNewDeviceByID(int physicalDeviceID);
"""


class GpuFilter:
    """The library's filter for rendered pictures on one GPU; `name` says which. Use `close` at the end."""

    def __init__(self, gpu: Device) -> None:
        """Raises RuntimeError where the library has no part for this GPU, or cannot begin there."""
        import pyoidn

        found = _device_of(gpu)
        if found is None:
            raise RuntimeError(f"Open Image Denoise does not find {gpu.name} among its devices")
        number, self.name = found
        self._device = pyoidn.Device.__new__(pyoidn.Device)  # as its from_torch does; __init__ takes only a kind
        self._device._device = _library().oidnNewDeviceByID(number)
        self._check("no device")
        self._filter: Any = None
        try:
            self._device.commit()
            self._check("no device")
            self._filter = pyoidn.Filter(self._device)
            self._filter.set_bool("hdr", True)
            self._check("no filter")
            self(np.ones((16, 16, 3), np.float32), None, None, True)  # loads what the first picture would wait for
        except RuntimeError:
            self.close()
            raise

    def __call__(
        self, color: np.ndarray, albedo: np.ndarray | None, normal: np.ndarray | None, fine: bool
    ) -> np.ndarray:
        """As `denoise.on_processor`. The pixels go through the GPU's memory: not every GPU reads the machine's."""
        import pyoidn

        height, width = color.shape[:2]
        given = {"color": color, "albedo": albedo, "normal": normal}
        smooth, size = np.empty((height, width, 3), np.float32), color.nbytes
        buffer = pyoidn.Buffer(self._device, 4 * size, pyoidn.OIDN_STORAGE_DEVICE)
        self._check("no buffer")
        try:
            for place, (name, image) in enumerate([*given.items(), ("output", smooth)]):
                if image is None:
                    self._filter.unset_image(name)
                    continue
                if image is not smooth:
                    buffer.write(place * size, size, np.ascontiguousarray(image))
                self._filter.set_image(name, buffer, pyoidn.OIDN_FORMAT_FLOAT3, width, height, place * size)
            self._filter.set_quality(pyoidn.OIDN_QUALITY_HIGH if fine else pyoidn.OIDN_QUALITY_FAST)
            self._filter.commit()
            self._check("the filter was not prepared")
            self._filter.execute()
            buffer.read(3 * size, size, smooth)
            self._check("the filter did not run")
        finally:
            buffer.release()
        return smooth

    def close(self) -> None:
        """Give the GPU's memory back."""
        if self._filter is not None:
            self._filter.release()
        self._device.release()

    def _check(self, what: str) -> None:
        """Raise RuntimeError where the library has failed since the last check."""
        if (error := self._device.get_error()) is not None:
            raise RuntimeError(f"{what}: {error}")


def _device_of(gpu: Device) -> tuple[int, str] | None:
    """The number of the library's device that is EGL's `gpu`, and a name for it; None where it has none.

    NVIDIA's EGL and CUDA say the same UUID. Mesa's UUIDs are of its own making: other cards are told by their places
    on the PCI bus.
    """
    from pyoidn.capi import oidn_ffi

    library = _library()
    for number in range(library.oidnGetNumPhysicalDevices()):
        kind = KINDS.get(library.oidnGetPhysicalDeviceInt(number, b"type"))
        if kind is None:
            continue
        if _uuid(number) != gpu.uuid and _pci(number) != gpu.pci:
            continue
        name = oidn_ffi.string(library.oidnGetPhysicalDeviceString(number, b"name")).decode(errors="replace")
        return number, f"{kind} ({name})"
    return None


def _uuid(number: int) -> str | None:
    """32 hexadecimal digits; None where the library does not know."""
    from pyoidn.capi import oidn_ffi

    if not _library().oidnGetPhysicalDeviceBool(number, b"uuidSupported"):
        return None
    size = oidn_ffi.new("size_t*")
    data = _library().oidnGetPhysicalDeviceData(number, b"uuid", size)
    return bytes(oidn_ffi.buffer(data, size[0])).hex()


def _pci(number: int) -> str | None:
    """As Linux writes it, 0000:01:00.0; None where the library does not know."""
    if not _library().oidnGetPhysicalDeviceBool(number, b"pciAddressSupported"):
        return None
    names = b"pciDomain", b"pciBus", b"pciDevice", b"pciFunction"
    domain, bus, device, function = (_library().oidnGetPhysicalDeviceInt(number, name) for name in names)
    return f"{domain:04x}:{bus:02x}:{device:02x}.{function:x}"


@cache
def _library() -> Any:
    from pyoidn.capi import oidn_Capi, oidn_ffi

    oidn_ffi.cdef(DECLARATIONS, override=True)  # a later pyoidn may declare them
    return oidn_Capi
