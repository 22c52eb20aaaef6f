# SPDX-License-Identifier: GPL-2.0-only
"""The files of an installed wheel of gpu_rve: its library needs no CUDA library to be loaded, and finds
NVRTC of the package nvidia-cuda-nvrtc. Run by wheel.sh.

    python3 wheel_contents.py [--cpu]
"""

import ctypes
import pathlib
import sys

import gpu_rve

FOLDER = pathlib.Path(gpu_rve.__file__).resolve().parent
DLINFO_SEARCH, DLINFO_SIZE = 4, 5    # RTLD_DI_SERINFO, RTLD_DI_SERINFOSIZE


class Entry(ctypes.Structure):
    """Dl_serpath"""
    _fields_ = [("name", ctypes.c_char_p), ("flags", ctypes.c_uint)]


def search_folders(library):
    """Returns the folders in which dlopen, called by the library, searches."""

    class Size(ctypes.Structure):
        """Dl_serinfo without its list"""
        _fields_ = [("size", ctypes.c_size_t), ("count", ctypes.c_uint)]

    dlinfo = ctypes.CDLL(None).dlinfo
    handle = ctypes.c_void_p(library._handle)
    size = Size()
    assert dlinfo(handle, DLINFO_SIZE, ctypes.byref(size)) == 0
    buffer = ctypes.create_string_buffer(size.size)
    assert dlinfo(handle, DLINFO_SIZE, buffer) == 0
    assert dlinfo(handle, DLINFO_SEARCH, buffer) == 0
    entries = (Entry * size.count).from_buffer(buffer, ctypes.sizeof(Size))
    return [pathlib.Path(entry.name.decode()) for entry in entries]


def main():
    assert FOLDER.is_relative_to(sys.prefix), FOLDER
    assert (FOLDER / "py.typed").exists()
    # What the wheel brings, apart from the library and its header, is the library of OpenMP.
    brought = [path.name for path in (FOLDER.parent / "gpu_rve.libs").iterdir()]
    assert len(brought) == 1 and brought[0].startswith("libgomp"), brought
    loaded = pathlib.Path("/proc/self/maps").read_text(encoding="utf-8")
    assert "gpu_rve/librve.so" in loaded and brought[0] in loaded
    for name in ("libcudart", "libcuda.", "libnvrtc"):
        assert name not in loaded, name
    if "--cpu" in sys.argv:
        return
    folders = search_folders(ctypes.CDLL(str(FOLDER / "librve.so")))
    found = [path for folder in folders for path in folder.glob("libnvrtc.so.13")]
    expected = FOLDER.parent / "nvidia" / "cu13" / "lib" / "libnvrtc.so.13"
    assert found and found[0].samefile(expected), (folders, found)
    version = [ctypes.c_int(), ctypes.c_int()]
    assert ctypes.CDLL(str(found[0])).nvrtcVersion(*map(ctypes.byref, version)) == 0
    print("NVRTC", ".".join(str(number.value) for number in version))


if __name__ == "__main__":
    main()
