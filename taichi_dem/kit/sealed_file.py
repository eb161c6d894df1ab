"""Files of arrays that end with a digest of all their bytes, so that no change goes unnoticed.

The file is a NumPy archive (``np.load`` reads it) whose comment is "sha256 " and the digest, 64
hexadecimal digits, of everything before them.
"""

import ast
import hashlib
import math
import os
import zipfile
from collections.abc import Mapping
from typing import IO, Any

import numpy as np

from taichi_dem.kit.validation import FileName

_SEAL, _DIGITS = b"sha256 ", 64
_CHUNK = 1 << 20
#: Of the text that describes an array [bytes].
_MOST_HEADER = 4096
#: Kinds of numbers and of text: nothing that Python would have to build from a description.
_KINDS = "?biufcU"


def write_sealed(path: FileName, arrays: Mapping[str, np.ndarray]) -> None:
    """Write arrays by name; on the disk when it returns. Equal arrays give equal bytes.

    Raises OSError where it cannot be written.
    """
    with open(path, "wb") as file:
        with zipfile.ZipFile(file, "w") as archive:
            for name, array in arrays.items():
                member = zipfile.ZipInfo(f"{name}.npy")
                with archive.open(member, "w", force_zip64=True) as place:
                    np.lib.format.write_array(place, np.asarray(array), allow_pickle=False)
            archive.comment = _SEAL + b"0" * _DIGITS
    with open(path, "r+b") as file:
        sealed = _digest(file, os.path.getsize(path) - _DIGITS)
        file.write(sealed)
        file.flush()
        os.fsync(file.fileno())


def read_sealed(path: FileName) -> dict[str, np.ndarray]:
    """Arrays by name. No size is believed before it is checked, and nothing is unpickled.

    Raises ValueError for a file that is not as it was written, OSError for one that cannot be read.
    """
    with open(path, "rb") as file:
        size = os.fstat(file.fileno()).st_size
        if size < len(_SEAL) + _DIGITS:
            raise ValueError("too short")
        digest = _digest(file, size - _DIGITS)
        if file.read(_DIGITS) != digest:
            raise ValueError("its digest does not fit")
        try:
            with zipfile.ZipFile(file) as archive:
                return _members(archive, size)
        except (zipfile.BadZipFile, NotImplementedError, EOFError, RuntimeError) as error:
            raise ValueError(str(error)) from None


def _digest(file: IO[bytes], size: int) -> bytes:
    """Digest, in letters, of the first bytes of a file; leaves the file behind them."""
    made, left = hashlib.sha256(), size
    file.seek(0)
    while left > 0:
        chunk = file.read(min(left, _CHUNK))
        if not chunk:
            raise ValueError("too short")
        made.update(chunk)
        left -= len(chunk)
    return made.hexdigest().encode()


def _members(archive: zipfile.ZipFile, size: int) -> dict[str, np.ndarray]:
    found = archive.infolist()
    if sum(member.file_size for member in found) > size or any(
        member.compress_type != zipfile.ZIP_STORED or not member.filename.endswith(".npy")
        for member in found
    ):
        raise ValueError("it is no archive of plain arrays")
    arrays = {}
    for member in found:
        with archive.open(member) as place:
            arrays[member.filename[: -len(".npy")]] = _array(place, member.file_size)
    if len(arrays) < len(found):
        raise ValueError("two arrays have one name")
    return arrays


def _array(place: IO[bytes], size: int) -> np.ndarray:
    """Array of a member of some bytes: a description, then just as many bytes as it needs."""
    version = np.lib.format.read_magic(place)
    if version != (1, 0):
        raise ValueError(f"version {version} of an array")
    length = int.from_bytes(place.read(2), "little")
    kind, shape, columns_first = _described(place.read(min(length, _MOST_HEADER)))
    data = place.read(size)
    if math.prod(shape) * kind.itemsize != len(data):
        raise ValueError("an array is not as long as its shape says")
    order: Any = "F" if columns_first else "C"
    return np.frombuffer(data, kind).reshape(shape, order=order).copy(order="K")


def _described(text: bytes) -> tuple[np.dtype, tuple[int, ...], bool]:
    """Type, shape and order from the description of an array, a dict in Python's words."""
    try:
        said = ast.literal_eval(text.decode("latin1").strip())
        kind, shape = np.dtype(str(said["descr"])), said["shape"]
    except (SyntaxError, TypeError, KeyError, RecursionError, MemoryError) as error:
        raise ValueError(f"an array is not described: {error}") from None
    plain = isinstance(shape, tuple) and all(type(n) is int and 0 <= n < 2**48 for n in shape)
    if kind.kind not in _KINDS or kind.itemsize == 0 or not plain or len(shape) > 32:
        raise ValueError("an array has no plain type or shape")
    return kind, shape, bool(said.get("fortran_order"))
