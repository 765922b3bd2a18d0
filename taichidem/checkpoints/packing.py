"""Turn nested Python values into JSON and one run of bytes, and back, to the last bit and without pickle."""

from __future__ import annotations

import zlib
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np

from taichidem.errors import InputError


class Packer:
    """Collect the bytes of arrays beside JSON that says what they are.

    Kept are None, truth values, numbers, texts, arrays of numbers, and lists, tuples, mappings by text and the named
    dataclasses of these.

    Args:
        types: dataclasses that may occur.
        data: bytes that were packed before.
    """

    def __init__(self, types: tuple[type, ...] = (), data: bytes = b"") -> None:
        self.types = {kind.__name__: kind for kind in types}
        self.data = bytearray(data)

    def pack(self, value: Any) -> Any:
        """Return the JSON of a value and append its arrays to `data`.

        Raises:
            InputError: a value of another type.
        """
        if isinstance(value, np.ndarray):
            return {"array": self._append(value)}
        if isinstance(value, np.generic):
            return {"number": self._append(np.asarray(value))}
        if value is None or isinstance(value, (bool, int, float, str)):
            return value
        if isinstance(value, list):
            return [self.pack(held) for held in value]
        if isinstance(value, tuple):
            return {"tuple": [self.pack(held) for held in value]}
        if isinstance(value, Mapping) and all(isinstance(key, str) for key in value):
            return {"mapping": {key: self.pack(held) for key, held in value.items()}}
        if is_dataclass(value) and type(value).__name__ in self.types:
            own = {field.name: self.pack(getattr(value, field.name)) for field in fields(value)}
            return {type(value).__name__: own}
        raise InputError(
            f"{value!r} of type {type(value).__name__} can't be kept in a checkpoint. Use numbers, texts, arrays of numbers, "
            "and lists, tuples or mappings of these."
        )

    def _append(self, array: np.ndarray) -> list:
        if array.dtype.kind not in "biufU":
            raise InputError(
                f"An array of {array.dtype} can't be kept in a checkpoint. Use arrays of numbers, truth values or texts."
            )
        place = len(self.data)
        self.data += np.ascontiguousarray(array).tobytes()
        return [array.dtype.str, list(array.shape), place]

    def unpack(self, packed: Any) -> Any:
        """Return the value of which `pack` gave the JSON."""
        if isinstance(packed, list):
            return [self.unpack(held) for held in packed]
        if not isinstance(packed, dict):
            return packed
        ((kind, held),) = packed.items()
        if kind == "array":
            return self._array(*held)
        if kind == "number":
            return self._array(*held)[()]
        if kind == "tuple":
            return tuple(self.unpack(part) for part in held)
        parts = {name: self.unpack(part) for name, part in held.items()}
        return parts if kind == "mapping" else self.types[kind](**parts)

    def _array(self, dtype: str, shape: list[int], place: int) -> np.ndarray:
        kind = np.dtype(dtype)
        count = int(np.prod(shape))
        return np.frombuffer(self.data, kind, count, place).reshape(shape).copy() if count else np.zeros(shape, kind)


def checksum(value: Any) -> int:
    """Return a number that tells a value from others."""
    packer = Packer()
    text = repr(packer.pack(value))
    return zlib.crc32(bytes(packer.data), zlib.crc32(text.encode()))
