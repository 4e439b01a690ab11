"""`python -m tests.bench.radv FILE.spv ...`: compiles kernels for a GPU that need not be there.

Mesa's RADV compiles for the AMD GPU that RADV_FORCE_FAMILY names, and says on stderr what became of each kernel
(RADV_DEBUG=shaderstats); `statistics` starts the process and reads that.
"""

from __future__ import annotations

import os
import re
import resource
import struct
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

FOLDERS = ("/usr/share/vulkan/icd.d", "/usr/local/share/vulkan/icd.d", "/etc/vulkan/icd.d")
FAMILY = "NAVI31"  # RDNA 3
WAVES = 16  # of a SIMD of that family at most
PATIENCE_S = 600.0

# SPIR-V, "Binary form": operations and decorations, and what Vulkan calls variables of these storage classes.
DECORATE, VARIABLE, POINTER, ARRAY, CONSTANT, BINDING, SET = 71, 59, 32, 28, 43, 33, 34
TEXTURE, UNIFORM, STORAGE = 1, 6, 7
KINDS = {0: TEXTURE, 2: UNIFORM, 12: STORAGE}
HEADER = 5  # words

LINE = re.compile(r"^(VGPRs|Spilled VGPRs|Spilled SGPRs|Scratch size|Code size|Subgroups per SIMD): (\d+)$", re.M)


@dataclass(frozen=True)
class Statistics:
    """What the compiler says of a kernel; sizes in bytes, `scratch` for each lane of a wave's 32 together."""

    vgprs: int
    spilled: int
    scratch: int
    waves: int
    code: int


class NoRadv(Exception):
    """RADV is not installed, or it did not compile."""


def driver() -> Path | None:
    """The file by which Vulkan's loader finds RADV."""
    found = (path for folder in FOLDERS for path in sorted(Path(folder).glob("radeon_icd*.json")))
    return next(found, None)


def statistics(paths: Sequence[Path]) -> list[Statistics]:
    """Of these files of SPIR-V. Raises NoRadv."""
    file = driver()
    if file is None:
        raise NoRadv("RADV is not installed: on Debian `apt-get install mesa-vulkan-drivers libvulkan1`")
    radv = {"VK_DRIVER_FILES": str(file), "RADV_FORCE_FAMILY": FAMILY, "RADV_DEBUG": "shaderstats,nocache"}
    command = [sys.executable, "-m", "tests.bench.radv", *map(str, paths)]
    environment = {**os.environ, **radv}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=PATIENCE_S)
    values = [int(value) for _, value in LINE.findall(done.stderr)]
    names = [name for name, _ in LINE.findall(done.stderr)]
    if done.returncode or len(names) != 6 * len(paths):
        raise NoRadv(f"RADV compiled {len(names) // 6} of {len(paths)} kernels:\n{done.stderr[-2000:]}")
    rows = [dict(zip(names[i : i + 6], values[i : i + 6], strict=True)) for i in range(0, len(names), 6)]
    return [
        Statistics(
            vgprs=row["VGPRs"],
            spilled=row["Spilled VGPRs"],
            scratch=row["Scratch size"],
            waves=min(row["Subgroups per SIMD"], WAVES),  # Mesa 25.0 names more than a SIMD holds
            code=row["Code size"],
        )
        for row in rows
    ]


def bindings(words: Sequence[int]) -> dict[tuple[int, int], tuple[int, int]]:
    """{(set, binding): (kind of descriptor, count)} of a module's words."""
    binding: dict[int, int] = {}
    group: dict[int, int] = {}
    variables: dict[int, tuple[int, int]] = {}  # to the pointer's type and the storage class
    pointer: dict[int, int] = {}
    array: dict[int, int] = {}  # to the constant that is its length
    constant: dict[int, int] = {}
    at = HEADER
    while at < len(words):
        length, operation = words[at] >> 16, words[at] & 0xFFFF
        a = words[at + 1 : at + length]
        if operation == DECORATE and a[1] in (BINDING, SET):
            (binding if a[1] == BINDING else group)[a[0]] = a[2]
        elif operation == VARIABLE:
            variables[a[1]] = a[0], a[2]
        elif operation == POINTER:
            pointer[a[0]] = a[2]
        elif operation == ARRAY:
            array[a[0]] = a[2]
        elif operation == CONSTANT:
            constant[a[1]] = a[2]
        at += length
    found = {}
    for name, (kind, storage) in variables.items():
        if name in binding and storage in KINDS:
            count = constant.get(array.get(pointer[kind], 0), 1)
            found[group.get(name, 0), binding[name]] = KINDS[storage], count
    return found


def compile_all(paths: Sequence[str]) -> None:
    """Make a pipeline of each file, one after the other."""
    import vulkan as vk

    application = vk.VkApplicationInfo(pApplicationName="sunbox", apiVersion=1 << 22 | 3 << 12)
    instance = vk.vkCreateInstance(vk.VkInstanceCreateInfo(pApplicationInfo=application), None)
    gpu = vk.vkEnumeratePhysicalDevices(instance)[0]
    queue = vk.VkDeviceQueueCreateInfo(queueFamilyIndex=0, queueCount=1, pQueuePriorities=[1.0])
    wanted = vk.VkDeviceCreateInfo(
        queueCreateInfoCount=1, pQueueCreateInfos=[queue], pEnabledFeatures=vk.vkGetPhysicalDeviceFeatures(gpu)
    )
    device = vk.vkCreateDevice(gpu, wanted, None)
    for path in paths:
        code = Path(path).read_bytes()
        _compile(vk, device, code, bindings(struct.unpack(f"<{len(code) // 4}I", code)))


def _compile(vk: Any, device: Any, code: bytes, found: dict[tuple[int, int], tuple[int, int]]) -> None:
    stages = vk.VK_SHADER_STAGE_COMPUTE_BIT
    layouts = []
    for number in range(1 + max((group for group, _ in found), default=0)):
        rows = [
            vk.VkDescriptorSetLayoutBinding(binding=at, descriptorType=kind, descriptorCount=count, stageFlags=stages)
            for (group, at), (kind, count) in sorted(found.items())
            if group == number
        ]
        info = vk.VkDescriptorSetLayoutCreateInfo(bindingCount=len(rows), pBindings=rows)
        layouts.append(vk.vkCreateDescriptorSetLayout(device, info, None))
    whole = vk.VkPipelineLayoutCreateInfo(setLayoutCount=len(layouts), pSetLayouts=layouts)
    layout = vk.vkCreatePipelineLayout(device, whole, None)
    module = vk.vkCreateShaderModule(device, vk.VkShaderModuleCreateInfo(codeSize=len(code), pCode=code), None)
    stage = vk.VkPipelineShaderStageCreateInfo(stage=stages, module=module, pName="main")
    pipeline = vk.VkComputePipelineCreateInfo(stage=stage, layout=layout)
    vk.vkCreateComputePipelines(device, None, 1, [pipeline], None)


if __name__ == "__main__":
    soft, hard = resource.getrlimit(resource.RLIMIT_STACK)
    wanted = 1 << 30 if hard == resource.RLIM_INFINITY else hard
    if soft != resource.RLIM_INFINITY and soft < wanted:  # large kernels recurse deeply; a process's own stack grows
        resource.setrlimit(resource.RLIMIT_STACK, (wanted, hard))
        os.execv(sys.executable, [sys.executable, "-m", "tests.bench.radv", *sys.argv[1:]])
    compile_all(sys.argv[1:])
