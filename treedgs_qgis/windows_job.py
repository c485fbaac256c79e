"""A Windows job object: everything that the engine starts ends with it, and with QGIS, however that ends.

Windows has no process groups that can be ended as one: ``taskkill /T`` finds children by their parents, and misses
those whose parent is gone already. A job holds them all. The last handle of the job is this process's: when it is
closed, by a crash of QGIS too, Windows ends what is in the job. Standard library only; elsewhere nothing is done.
"""

from __future__ import annotations

import ctypes
import subprocess
import sys
from typing import Any

_EXTENDED_LIMITS = 9  # JobObjectExtendedLimitInformation
_KILL_ON_CLOSE = 0x2000  # JOB_OBJECT_LIMIT_KILL_ON_JOB_CLOSE


class _BasicLimits(ctypes.Structure):
    """JOBOBJECT_BASIC_LIMIT_INFORMATION."""

    _fields_ = (
        ("PerProcessUserTimeLimit", ctypes.c_int64),
        ("PerJobUserTimeLimit", ctypes.c_int64),
        ("LimitFlags", ctypes.c_uint32),
        ("MinimumWorkingSetSize", ctypes.c_size_t),
        ("MaximumWorkingSetSize", ctypes.c_size_t),
        ("ActiveProcessLimit", ctypes.c_uint32),
        ("Affinity", ctypes.c_size_t),
        ("PriorityClass", ctypes.c_uint32),
        ("SchedulingClass", ctypes.c_uint32),
    )


class ExtendedLimits(ctypes.Structure):
    """JOBOBJECT_EXTENDED_LIMIT_INFORMATION; 144 bytes on 64 bits."""

    _fields_ = (
        ("BasicLimitInformation", _BasicLimits),
        ("IoInfo", ctypes.c_uint64 * 6),
        ("ProcessMemoryLimit", ctypes.c_size_t),
        ("JobMemoryLimit", ctypes.c_size_t),
        ("PeakProcessMemoryUsed", ctypes.c_size_t),
        ("PeakJobMemoryUsed", ctypes.c_size_t),
    )


class Job:
    """A job with one process in it and all that it will start. ``handle`` 0: there is none, the caller has to find the
    children itself."""

    def __init__(self, process: subprocess.Popen, kernel: Any = None) -> None:
        self.handle = 0
        self._kernel = kernel if kernel is not None else _kernel32()
        # Popen keeps the process's handle under this name; there is no public one.
        handle = getattr(process, "_handle", None)
        if self._kernel is None or handle is None:
            return
        limits = ExtendedLimits()
        limits.BasicLimitInformation.LimitFlags = _KILL_ON_CLOSE
        made = self._kernel.CreateJobObjectW(None, None)
        if not made:
            return
        if self._kernel.SetInformationJobObject(
            made, _EXTENDED_LIMITS, ctypes.byref(limits), ctypes.sizeof(limits)
        ) and self._kernel.AssignProcessToJobObject(made, int(handle)):
            self.handle = made
        else:
            self._kernel.CloseHandle(made)

    def end(self) -> bool:
        """End everything in the job; False where there is none."""
        if not self.handle:
            return False
        handle, self.handle = self.handle, 0
        ended = bool(self._kernel.TerminateJobObject(handle, 1))
        self._kernel.CloseHandle(handle)
        return ended


def _kernel32() -> Any:
    """Windows' functions with their types (a handle is as wide as a pointer); ``None`` elsewhere."""
    if sys.platform != "win32":
        return None
    kernel = ctypes.WinDLL("kernel32", use_last_error=True)
    handle, flag = ctypes.c_void_p, ctypes.c_int
    for name, result, arguments in (
        ("CreateJobObjectW", handle, (ctypes.c_void_p, ctypes.c_wchar_p)),
        ("SetInformationJobObject", flag, (handle, flag, ctypes.c_void_p, ctypes.c_uint32)),
        ("AssignProcessToJobObject", flag, (handle, handle)),
        ("TerminateJobObject", flag, (handle, ctypes.c_uint32)),
        ("CloseHandle", flag, (handle,)),
    ):
        function = getattr(kernel, name)
        function.restype, function.argtypes = result, arguments
    return kernel
