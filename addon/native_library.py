"""Loads `libsppm.so` once, checks that it can be used in this process, and raises what its calls report.

A status other than SPPM_OK becomes an `SppmError` with the library's own message.
"""

import ctypes
import os
from pathlib import Path

from . import native_abi as abi

LIBRARY_PATH = Path(__file__).parent / "lib" / "libsppm.so"
STATUS_CANCELLED = 7
STATUS_NAMES = ("OK", "invalid argument", "invalid state", "out of memory", "I/O error", "unsupported", "internal error",
                "cancelled")


class SppmError(RuntimeError):
    """A call of the library failed; `status` is its SppmStatus (0 if the library could not be used at all)."""

    def __init__(self, message, status=0):
        super().__init__(message)
        self.status = status


class Cancelled(SppmError):
    """The step was given up; the session is as the iteration before left it."""


_libraries = {}


def library(path=None):
    """Loads the library once, compares ABI versions and traces the known ray.

    Load it after bpy: RTLD_DEEPBIND makes it find its own Embree and TBB before those of Blender.

    Args:
        path: of the shared library; None for `lib/libsppm.so` beside this file.

    Raises:
        SppmError: it is missing, was built for another interface, or the process gives it a foreign Embree.
    """
    path = Path(path or LIBRARY_PATH).resolve()
    if path not in _libraries:
        _libraries[path] = _load(path)
    return _libraries[path]


def version():
    """The library's version and those of what it was built with."""
    return library().sppm_version().decode()


def _load(path):
    if not path.is_file():
        raise SppmError(f"the renderer library is missing: {path} (build it with ./dev build)")
    try:
        lib = ctypes.CDLL(str(path), mode=os.RTLD_NOW | os.RTLD_LOCAL | getattr(os, "RTLD_DEEPBIND", 0))
        _declare(lib)
    except (OSError, AttributeError) as error:
        raise SppmError(f"cannot load {path}: {error}") from error
    return lib


def _declare(lib):
    for name, (result, arguments) in abi.PLAIN_PROTOTYPES.items():
        function = getattr(lib, name)
        function.restype, function.argtypes = result, arguments
    if lib.sppm_abi_version() != abi.ABI_VERSION:
        raise SppmError(f"the library has interface version {lib.sppm_abi_version()}, the add-on needs {abi.ABI_VERSION}")
    for name, arguments in abi.STATUS_PROTOTYPES.items():
        function = getattr(lib, name)
        function.restype, function.argtypes = ctypes.c_uint32, arguments
        function.errcheck = _raise_on_failure(lib)
    lib.sppm_self_test()


def _raise_on_failure(lib):
    def check(status, function, _arguments):
        if status == 0:
            return
        name = STATUS_NAMES[status] if status < len(STATUS_NAMES) else f"status {status}"
        message = (lib.sppm_last_message() or b"").decode("utf-8", "replace") or f"{function.__name__}: {name}"
        raise (Cancelled if status == STATUS_CANCELLED else SppmError)(message, status)

    return check
