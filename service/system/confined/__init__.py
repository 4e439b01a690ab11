"""What a process gives up before it works on strangers' data, so that these can cost no more than its limits.

child         how a child that parses begins, and how it works within bounds
limits        priority, memory, processor time, files: what a process may take
rights        what it may do: everything that it does not need is given up for good
kernel        the numbers of system calls, and the kernel's seccomp and Landlock

The kernel's interfaces are called by ctypes. The packages for them on PyPI are no alternative: `landlock` and
`py-landlock` have only preliminary releases, `pyseccomp` has had none since 2021 and needs libseccomp on the machine.
"""

from service.system.confined.child import begin, bounded
from service.system.confined.limits import bound, cap, confine, unbind
from service.system.confined.rights import Rights, hide, renounce

__all__ = ["Rights", "begin", "bound", "bounded", "cap", "confine", "hide", "renounce", "unbind"]
