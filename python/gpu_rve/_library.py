# SPDX-License-Identifier: GPL-2.0-only
"""The shared library librve and its functions, declared by the header next to it."""

from __future__ import annotations

import os
import pathlib
import re
from typing import Any, Iterator, Mapping

import cffi  # type: ignore[import-untyped]
import numpy as np

HERE = pathlib.Path(__file__).resolve().parent


class Error(Exception):
    """Wrong input, a lack of memory, or a failure of the library; the text is that of the library.
    """


def _places() -> Iterator[tuple[pathlib.Path, pathlib.Path]]:
    """Returns candidates for library and header: the environment (GPU_RVE_LIBRARY), the folder of
    this file, or a build tree."""
    if "GPU_RVE_LIBRARY" in os.environ:
        library = pathlib.Path(os.environ["GPU_RVE_LIBRARY"])
        yield library, library.parent / "librve.h"
        yield library, HERE.parents[1] / "src" / "GPU_RVE" / "capi" / "librve.h"
        return
    yield HERE / "librve.so", HERE / "librve.h"


def _declarations(header: str) -> str:
    """Returns the declarations of the header that cffi can parse: without comments, preprocessor
    directives and parts for C++."""
    text = re.sub(r"/\*.*?\*/", "", header, flags=re.S)
    text = re.sub(r"#ifdef __cplusplus.*?#endif", "", text, flags=re.S)
    text = re.sub(r"^\s*#.*$", "", text, flags=re.M)
    return text.replace("RVE_API", "")


def _load() -> tuple[Any, Any]:
    for library, header in _places():
        if not (library.exists() and header.exists()):
            continue
        ffi = cffi.FFI()
        ffi.cdef(_declarations(header.read_text(encoding="utf-8")))
        lib = ffi.dlopen(str(library))
        expected = dict(
            re.findall(r"#define RVE_API_(MAJOR|MINOR) (\d+)", header.read_text(encoding="utf-8")))
        found = divmod(lib.rve_api_version(), 1000)
        if found[0] != int(expected["MAJOR"]) or found[1] < int(expected["MINOR"]):
            raise ImportError(
                f"{library} has interface {found[0]}.{found[1]}; {header} has "
                f"{expected['MAJOR']}.{expected['MINOR']}"
            )
        return ffi, lib
    missing = [str(path) for places in _places() for path in places if not path.exists()]
    raise ImportError("missing: " + ", ".join(dict.fromkeys(missing)) +
                      "; GPU_RVE_LIBRARY names librve.so, which needs librve.h in its folder")


ffi, lib = _load()


def text(pointer: Any) -> str:
    return str(ffi.string(pointer).decode("utf-8"))


def check(code: int) -> None:
    """Raises the library's error unless a call succeeded."""
    if code == lib.RVE_SUCCESS:
        return
    message = text(lib.rve_error())
    if code == lib.RVE_NO_MEMORY:
        raise MemoryError(message)
    raise Error(message)


def words(values: Mapping[str, Any]) -> bytes:
    """Returns keywords and values as the library reads them: True and False are yes and no, and
    None is omitted."""
    parts = []
    for keyword, value in values.items():
        if value is None:
            continue
        if isinstance(value, bool):
            value = "yes" if value else "no"
        parts.append(f"{keyword} {value if isinstance(value, str) else repr(value)}")
    return " ".join(parts).encode("utf-8")


def doubles(array: np.ndarray) -> Any:
    """Returns a pointer to a NumPy array of float64 in C order, without a copy."""
    return ffi.from_buffer("double[]", array, require_writable=False)


def saved_by(save: Any, pointer: Any) -> bytes:
    """Returns the bytes that a function of librve writes: the first call gives their number, the
    second one the bytes."""
    size = ffi.new("size_t *")
    check(save(pointer, ffi.NULL, 0, size))
    buffer = bytearray(size[0])
    check(save(pointer, ffi.from_buffer(buffer), len(buffer), size))
    return bytes(buffer)


def api_version() -> tuple[int, int]:
    """Returns (major, minor) of the library's interface."""
    major, minor = divmod(lib.rve_api_version(), 1000)
    return major, minor


def release() -> str:
    """Returns the release of GPU_RVE, such as "0.1.0"."""
    return text(lib.rve_release())
