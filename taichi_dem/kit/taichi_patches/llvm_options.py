"""Switch off passes of LLVM that cost time at each start and save none in a step."""

import ctypes
import functools
import mmap
import struct
import sys
from collections.abc import Sequence

import numpy as np

from taichi_dem.kit.taichi_patches.names import are_on

#: Of the ELF format: an entry of a table of symbols, and the kind of section that is one.
_SYMBOL = np.dtype([("name", "<u4"), ("kind", "<u4"), ("value", "<u8"), ("size", "<u8")])
_TABLE = 2
#: Options of LLVM 15, which ends the process on one that it does not know.
_OPTIONS = (
    b"-unroll-runtime=false",
    b"-disable-lsr",
    b"-disable-machine-cse",
    b"-disable-post-ra",
    b"-enable-misched=false",
)
_LIBRARY = "taichi._lib.core.taichi_python"
_PARSE, _KNOWN = b"LLVMParseCommandLineOptions", b"PyInit_taichi_python"


@functools.cache
def switch_off() -> None:
    """Switch them off for all kernels to come, where that can be done."""
    path = getattr(sys.modules.get(_LIBRARY), "__file__", None)
    if path is None or sys.platform != "linux" or not are_on():
        return
    places = addresses(path, (_PARSE, _KNOWN))
    if len(places) < 2:
        return
    known = ctypes.cast(ctypes.CDLL(path)[_KNOWN.decode()], ctypes.c_void_p).value or 0
    parse = ctypes.CFUNCTYPE(None, ctypes.c_int, ctypes.c_void_p, ctypes.c_char_p)
    words = (ctypes.c_char_p * (1 + len(_OPTIONS)))(b"taichi", *_OPTIONS)
    parse(known + places[_PARSE] - places[_KNOWN])(len(words), words, None)


def addresses(path: str, names: Sequence[bytes]) -> dict[bytes, int]:
    """Addresses in a 64-bit ELF file of those of some names that its table of symbols has."""
    places: dict[bytes, int] = {}
    with open(path, "rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data:
        sections = _sections(data)
        for kind, start, size, linked in sections:
            if kind == _TABLE:
                symbols = np.frombuffer(data[start : start + size], _SYMBOL)
                _, texts, room, _ = sections[linked]
                for name in names:
                    place = data.find(b"\0" + name + b"\0", texts, texts + room) + 1 - texts
                    for value in symbols["value"][symbols["name"] == place]:
                        places[name] = int(value)
    return places


def _sections(data):
    """Kind, start, size, and number of the section it refers to, of each section of a file."""
    (start,) = struct.unpack_from("<Q", data, 40)
    size, count = struct.unpack_from("<HH", data, 58)
    return [struct.unpack_from("<4x I 16x QQI", data, start + k * size) for k in range(count)]
