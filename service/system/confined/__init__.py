"""Confinement: a process gives up its rights before it works on strangers' data, so that these can cost no more than
its limits.

child         how a child that parses begins: its limits, the rights that it gives up for good, work within bounds
kernel        the numbers of system calls, and the kernel's seccomp and Landlock

The kernel's interfaces are called by ctypes. The packages for them on PyPI are no alternative: `landlock` and
`py-landlock` have only preliminary releases, `pyseccomp` has had none since 2021 and needs libseccomp on the machine.
"""

from service.system.confined.child import Rights, begin, bound, bounded, cap, confine, hide, renounce, unbind

__all__ = ["Rights", "begin", "bound", "bounded", "cap", "confine", "hide", "renounce", "unbind"]
