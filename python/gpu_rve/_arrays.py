# SPDX-License-Identifier: GPL-2.0-only
"""Arrays of callers without a copy: NumPy's, and those of other libraries by DLPack, in the memory
of the host or of a GPU."""

from __future__ import annotations

import ctypes
import dataclasses
import math
import operator
from typing import Any

import numpy as np

from ._library import Error

# dlpack.h
HOST_MEMORY = (1, 3)    # kDLCPU, kDLCUDAHost
CUDA_MEMORY = (2, 13)    # kDLCUDA, kDLCUDAManaged
TYPES = {0: "int", 1: "uint", 2: "float", 3: "opaque", 4: "bfloat", 5: "complex", 6: "bool"}
READ_ONLY = 1    # flag of a versioned tensor
DEFAULT_STREAM = 1    # DLPack's number of CUDA's (legacy) default stream, which librve uses


class Tensor(ctypes.Structure):
    """DLTensor: strides count elements and are missing if the tensor is in C order."""

    _fields_ = [("data", ctypes.c_void_p), ("device_type", ctypes.c_int32),
                ("device_id", ctypes.c_int32), ("ndim", ctypes.c_int32), ("code", ctypes.c_uint8),
                ("bits", ctypes.c_uint8), ("lanes", ctypes.c_uint16),
                ("shape", ctypes.POINTER(ctypes.c_int64)),
                ("strides", ctypes.POINTER(ctypes.c_int64)), ("byte_offset", ctypes.c_uint64)]


# The interpreter's lock is held during the call, since some deleters need it.
Deleter = ctypes.PYFUNCTYPE(None, ctypes.c_void_p)


class ManagedTensor(ctypes.Structure):
    """DLManagedTensor"""

    _fields_ = [("tensor", Tensor), ("context", ctypes.c_void_p), ("deleter", Deleter)]


class VersionedTensor(ctypes.Structure):
    """DLManagedTensorVersioned"""

    _fields_ = [("major", ctypes.c_uint32), ("minor", ctypes.c_uint32),
                ("context", ctypes.c_void_p), ("deleter", Deleter), ("flags", ctypes.c_uint64),
                ("tensor", Tensor)]


# Capsules store pointers to their names, which must live as long as the module.
NAMES = {b"dltensor": b"used_dltensor", b"dltensor_versioned": b"used_dltensor_versioned"}
LAYOUTS: dict[bytes, type[ctypes.Structure]] = {
    b"dltensor": ManagedTensor, b"dltensor_versioned": VersionedTensor
}
_is_valid = ctypes.PYFUNCTYPE(ctypes.c_int, ctypes.py_object,
                              ctypes.c_char_p)(("PyCapsule_IsValid", ctypes.pythonapi))
_pointer_of = ctypes.PYFUNCTYPE(ctypes.c_void_p, ctypes.py_object,
                                ctypes.c_char_p)(("PyCapsule_GetPointer", ctypes.pythonapi))
_rename = ctypes.PYFUNCTYPE(ctypes.c_int, ctypes.py_object,
                            ctypes.c_char_p)(("PyCapsule_SetName", ctypes.pythonapi))


class Lent:
    """A tensor from a capsule, which is returned to its owner when this object is deleted."""

    managed: Any = None

    def __init__(self, capsule: Any):
        name = next((name for name in NAMES if _is_valid(capsule, name)), None)
        if name is None:
            raise Error(
                "__dlpack__ returned no capsule of a tensor, or a capsule that was used before")
        self.address = _pointer_of(capsule, name)
        _rename(capsule, NAMES[name])
        self.managed = LAYOUTS[name].from_address(self.address)

    def __del__(self) -> None:
        if self.managed is not None and self.managed.deleter:
            self.managed.deleter(self.address)

    @property
    def version(self) -> int:
        return int(getattr(self.managed, "major", 1))

    @property
    def writable(self) -> bool:
        return not getattr(self.managed, "flags", 0) & READ_ONLY


@dataclasses.dataclass
class Found:
    """An array for librve: an address, and the owner that keeps it alive."""

    address: int
    dtype: str
    shape: tuple[int, ...]
    strides: tuple[int, ...]    # [bytes]
    writable: bool
    memory: tuple[int, int]    # DLPack's kind, and the number of the device
    owner: Any

    @property
    def on_device(self) -> bool:
        return self.memory[0] not in HOST_MEMORY


def c_strides(shape: tuple[int, ...], size: int) -> tuple[int, ...]:
    """Returns strides of an array in C order [bytes]."""
    return tuple(size * math.prod(shape[k + 1:]) for k in range(len(shape)))


def memory_of(array: Any) -> tuple[int, int]:
    """Returns DLPack's kind of memory and the number of the device."""
    if isinstance(array, np.ndarray) or not hasattr(array, "__dlpack_device__"):
        return 1, 0
    kind, number = array.__dlpack_device__()
    return int(kind), int(number)


def is_on_device(array: Any) -> bool:
    """Returns True if an array is in the memory of a device and not of the host."""
    return memory_of(array)[0] not in HOST_MEMORY


def require_memory(memory: tuple[int, int], name: str, device: int | None) -> None:
    """Raises an error unless an array in such memory is on the host or on this CUDA device of a
    batch; None: CPU threads."""
    kind, number = memory
    if kind in HOST_MEMORY:
        return
    if device is None:
        raise Error(
            f"{name} is in the memory of a device, and the batch is on CPU threads: copy it to the "
            "host first"
        )
    if kind not in CUDA_MEMORY or number != device:
        where = (f"CUDA device {number}" if kind in CUDA_MEMORY else
                 f"a device that is not CUDA's (DLPack's kind {kind})")
        raise Error(
            f"{name} is in the memory of {where}; it must be in the memory of CUDA device "
            f"{device}, which has the batch, or of the host"
        )


def capsule_of(array: Any, name: str) -> Any:
    """Returns the capsule that lends an array."""
    # The lender makes this stream wait for pending work on the array.
    stream = {"stream": DEFAULT_STREAM} if is_on_device(array) else {}
    try:
        try:
            return array.__dlpack__(max_version=(1, 0), **stream)
        except TypeError:    # libraries that lend unversioned tensors only
            return array.__dlpack__(**stream)
    except BufferError as error:
        raise Error(f"{name} cannot be exported by DLPack: {error}") from error


def find(array: Any, name: str) -> Found:
    """Finds address and layout of an array without a copy."""
    if isinstance(array, np.ndarray):
        return Found(array.ctypes.data, str(array.dtype), array.shape, array.strides,
                     array.flags.writeable, memory_of(array), array)
    if not hasattr(array, "__dlpack__"):
        raise Error(
            f"{name} is of type {type(array).__name__}; it must be an array of NumPy or of a "
            "library that has DLPack"
        )
    lent = Lent(capsule_of(array, name))
    if lent.version != 1:
        raise Error(f"{name} is a tensor of DLPack {lent.version}; it must be of DLPack 1 or older")
    tensor = lent.managed.tensor
    shape, size = tuple(tensor.shape[:tensor.ndim]), tensor.bits * tensor.lanes // 8
    strides = tuple(
        size * s
        for s in tensor.strides[:tensor.ndim]) if tensor.strides else c_strides(shape, size)
    dtype = f"{TYPES.get(tensor.code, 'unknown')}{tensor.bits}" + (f"x{tensor.lanes}"
                                                                   if tensor.lanes != 1 else "")
    return Found((tensor.data or 0) + tensor.byte_offset, dtype, shape, strides, lent.writable,
                 (tensor.device_type, tensor.device_id), lent)


def found_doubles(array: Any, name: str, shape: tuple[int, ...], device: int | None,
                  writes: bool) -> Found:
    """Returns an array of float64 in C order of this shape, on the host or on this CUDA device,
    which librve accesses in place."""
    require_memory(memory_of(array), name, device)
    found = find(array, name)
    require_memory(found.memory, name, device)
    if found.dtype != "float64":
        raise Error(f"{name} has dtype {found.dtype}; it must have float64")
    if found.shape != shape:
        raise Error(f"{name} has shape {found.shape}; it must have {shape}")
    expected = c_strides(shape, 8)
    # Strides of axes of length 1 and of empty arrays are meaningless.
    if math.prod(shape) > 0 and any(
            s != e for s, e, length in zip(found.strides, expected, shape) if length > 1):
        raise Error(f"{name} has strides {found.strides} [bytes]; they must be {expected}, C order")
    if writes and not found.writable:
        raise Error(f"{name} is read-only; it must be writable")
    return found


def integer(value: Any, name: str, least: int | None = None) -> int:
    """Returns an integer of a caller, int or NumPy's; raises TypeError for other values, such as
    1.5 or True."""
    if isinstance(value, (bool, np.bool_)):
        raise TypeError(f"{name} is {value}; it must be an integer")
    try:
        number = operator.index(value)
    except TypeError:
        raise TypeError(f"{name} is {value!r}; it must be an integer") from None
    if least is not None and number < least:
        raise Error(f"{name} is {number}; it must be at least {least}")
    return number


def integers(values: Any, name: str, shape: tuple[int, ...], dtype: type) -> np.ndarray:
    """Returns integers of a caller as an array of this type and shape; raises TypeError for other
    values, and Error for values out of range."""
    if is_on_device(values):
        raise Error(f"{name} is in the memory of a device; it must be on the host")
    if not isinstance(values, np.ndarray) and hasattr(values, "__dlpack__"):
        values = np.from_dlpack(values)
    given = np.asarray(values)
    if given.size > 0 and given.dtype.kind not in "iu":
        raise TypeError(f"{name} has dtype {given.dtype}; it must have integers")
    limits = np.iinfo(dtype)
    if given.size > 0 and (given.min() < limits.min or given.max() > limits.max):
        raise Error(f"{name} has a number that is not from {limits.min} to {limits.max}")
    # np.ascontiguousarray would give () an axis
    return np.array(np.broadcast_to(given, shape), dtype=dtype, order="C")


def numbers(values: Any, name: str, shape: tuple[int, ...], dtype: type = float) -> np.ndarray:
    """Returns numbers of a caller on the host as an array of this shape in C order, with a copy
    only if necessary. Arrays of other libraries come by DLPack."""
    if is_on_device(values):
        raise Error(f"{name} is in the memory of a device; it must be on the host")
    if not isinstance(values, np.ndarray) and hasattr(values, "__dlpack__"):
        values = np.from_dlpack(values)
    return np.ascontiguousarray(np.broadcast_to(np.asarray(values, dtype=dtype), shape))
