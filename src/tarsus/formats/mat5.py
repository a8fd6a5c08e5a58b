"""Variables of MATLAB files of version 5 (v5, v6, v7), by the format MAT-File Level 5, in either order of bytes."""

from __future__ import annotations

import math
import zlib
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from tarsus.base.errors import InputError
from tarsus.formats.mat_parts import DEEPEST, TOO_DEEP, Left, an_object, whole
from tarsus.formats.raw import check_values

_HEADER, _TAG = 128, 8
"""Bytes of the header, and of the tag of an element: its kind and its size."""
_MATRIX, _COMPRESSED = 14, 15
"""Kinds of elements that hold a variable, by the format (miMATRIX, miCOMPRESSED)."""
_STORED = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
"""Numbers by the kinds of elements that hold them; classes of fewer bytes are stored as such where these are enough."""
_TEXT = {16: "utf-8", 17: "utf-16", 18: "utf-32"}
"""Encodings by the kinds of elements."""
_CLASSES = {6: "f8", 7: "f4", 8: "i1", 9: "u1", 10: "i2", 11: "u2", 12: "i4", 13: "u4", 14: "i8", 15: "u8"}
"""Numbers of numeric classes."""
_CELL, _STRUCTURE, _OLD_OBJECT, _CHARACTERS, _SPARSE, _FUNCTION, _OBJECT = 1, 2, 3, 4, 5, 16, 17
"""Other classes."""
_IS_COMPLEX = 0x800
"""Bit of the flags of a matrix that has an imaginary part."""


class _Damage(Exception):
    """Elements that do not fit into each other."""


class _Element(NamedTuple):
    """An element: its kind, and its bytes."""

    kind: int
    data: memoryview


def variables(source: str, data: bytes) -> dict[str, Any]:
    """Variables by name: arrays, text, structures as tables by name, cells and arrays of structures as lists by
    columns, and `Left` for those that are not read.

    Raises
    ------
    InputError
        If the file is cut, a variable does not fit into its own size or its checksum, or they unpack to too much.
    """
    reader = _Elements(">" if data[126:128] == b"MI" else "<")
    view = memoryview(data)
    elements = list(reader.elements(source, view[_HEADER:]))
    check_values(source, sum(reader.unpacked(one) for one in elements) // 8)
    out: dict[str, Any] = {}
    for number, one in enumerate(elements, start=1):
        name = f"variable {number}"
        try:
            content = reader.opened(one)
            if content is None:
                continue
            name = reader.name(content) or name
            found, value = reader.matrix(content, DEEPEST)
        except (_Damage, zlib.error) as error:
            raise InputError(f"{source} is damaged or truncated: '{name}' cannot be read ({error})") from None
        except (ValueError, UnicodeError) as error:  # of a kind that the format does not say
            out[name] = Left(f"which cannot be read ({error})")
            continue
        if found:  # what the objects of a file share has no name
            out[found] = value
    return out


class _Elements:
    """Elements of a file by its order of bytes, as numpy writes it."""

    def __init__(self, order: str) -> None:
        self.order = order

    def _tag(self, data: memoryview) -> tuple[int, int]:
        kind, size = np.frombuffer(data[:_TAG], f"{self.order}u4")
        return int(kind), int(size)

    def elements(self, source: str, data: memoryview) -> Iterator[_Element]:
        """Elements of a file."""
        at = 0
        while at + _TAG <= len(data):
            kind, size = self._tag(data[at:])
            at += _TAG
            if at + size > len(data):
                raise InputError(f"{source} is truncated: its last variable does not end")
            yield _Element(kind, data[at : at + size])
            at += size

    def unpacked(self, one: _Element) -> int:
        """Bytes that an element unpacks to, as it announces itself."""
        if one.kind != _COMPRESSED:
            return len(one.data)
        begin = zlib.decompressobj().decompress(one.data, _TAG)
        return self._tag(memoryview(begin))[1] if len(begin) == _TAG else 0

    def opened(self, one: _Element) -> memoryview | None:
        """The content of an element that holds a matrix, of which as much is unpacked as it announces."""
        if one.kind == _MATRIX:
            return one.data
        if one.kind != _COMPRESSED:
            return None
        size = self.unpacked(one) + _TAG
        unpacking = zlib.decompressobj()
        content = unpacking.decompress(one.data, size)
        if len(content) < size:
            raise _Damage("it unpacks to less than it announces")
        unpacking.decompress(unpacking.unconsumed_tail, 1)  # up to its checksum
        if not unpacking.eof:
            raise _Damage("it unpacks to more than it announces")
        kind, _ = self._tag(memoryview(content))
        return memoryview(content)[_TAG:] if kind == _MATRIX else None

    def _parts(self, data: memoryview) -> Iterator[_Element]:
        """Elements within one: four bytes fit into the tag itself, others begin at whole eight bytes."""
        at = 0
        while at + _TAG <= len(data):
            kind, size = self._tag(data[at:])
            if kind >> 16:
                kind, size, first, after = kind & 0xFFFF, kind >> 16, at + 4, at + _TAG
            else:
                first = at + _TAG
                after = first + size + (-size % 8)
            if first + size > min(len(data), after):
                raise _Damage("an element is longer than the one it is in")
            yield _Element(kind, data[first : first + size])
            at = after

    def _next(self, parts: Iterator[_Element]) -> _Element:
        found = next(parts, None)
        if found is None:
            raise _Damage("it ends too early")
        return found

    def _numbers(self, one: _Element, count: int | None = None) -> np.ndarray:
        """Numbers of an element; of so many as there have to be."""
        if one.kind not in _STORED:
            raise _Damage(f"numbers are of the unknown kind {one.kind}")
        kind = np.dtype(f"{self.order}{_STORED[one.kind]}")
        if len(one.data) % kind.itemsize or count not in (None, len(one.data) // kind.itemsize):
            raise _Damage(f"it has {len(one.data) / kind.itemsize:g} numbers where its size says {count}")
        return np.frombuffer(one.data, kind)

    def _word(self, one: _Element) -> str:
        return bytes(one.data).split(b"\0")[0].decode("latin-1")

    def name(self, data: memoryview) -> str:
        """Name of a matrix, which stands behind its size, or of an object at once."""
        parts = self._parts(data)
        flags = self._numbers(self._next(parts))
        if len(flags) and int(flags[0]) & 0xFF != _OBJECT:
            self._next(parts)
        return self._word(self._next(parts))

    def matrix(self, data: memoryview, deepest: int) -> tuple[str, Any]:
        """Name and value of a variable, of an element of cells or of a field; nothing at all is an empty matrix."""
        if not len(data):
            return "", np.zeros(0)
        if deepest == 0:
            return "", TOO_DEEP
        parts = self._parts(data)
        flags = int(self._numbers(self._next(parts), 2)[0])
        of = flags & 0xFF
        if of == _OBJECT:
            name, _, kind = (self._word(self._next(parts)) for _ in range(3))
            return name, an_object(kind)
        size = tuple(int(one) for one in self._numbers(self._next(parts)))
        if min(size, default=0) < 0:
            raise _Damage("its size is below 0")
        name = self._word(self._next(parts))
        count = math.prod(size)
        if of in _CLASSES:
            return name, self._array(parts, size, of, bool(flags & _IS_COMPLEX))
        if of == _CELL:
            return name, [self._within(parts, deepest) for _ in range(count)]
        if of == _STRUCTURE:
            return name, self._structure(parts, count, deepest)
        if of == _CHARACTERS:
            return name, self._characters(self._next(parts), size)
        if of == _SPARSE:
            return name, self._sparse(parts, size, bool(flags & _IS_COMPLEX))
        if of == _OLD_OBJECT:
            return name, an_object(self._word(self._next(parts)))
        if of == _FUNCTION:
            return name, an_object("function_handle")
        raise ValueError(f"a variable of the unknown class {of}")

    def _within(self, parts: Iterator[_Element], deepest: int) -> Any:
        one = self._next(parts)
        if one.kind != _MATRIX:
            raise _Damage("a cell or field holds no matrix")
        return self.matrix(one.data, deepest - 1)[1]

    def _array(self, parts: Iterator[_Element], size: tuple[int, ...], of: int, complex_ones: bool) -> np.ndarray:
        """A numeric array, in the numbers of its class."""
        count = math.prod(size)
        kind = np.dtype(_CLASSES[of])
        values = self._numbers(self._next(parts), count).astype(kind)
        if complex_ones:
            values = values + 1j * self._numbers(self._next(parts), count).astype(kind)
        return values.reshape(size, order="F")

    def _structure(self, parts: Iterator[_Element], count: int, deepest: int) -> Any:
        """Fields of a structure by name, or a list of them for an array of structures."""
        width = int(self._numbers(self._next(parts), 1)[0])
        words = bytes(self._next(parts).data)
        if width < 1 or len(words) % width:
            raise _Damage("its fields have no names")
        names = [words[k : k + width].split(b"\0")[0].decode("latin-1") for k in range(0, len(words), width)]
        if count and not names:
            return {}
        found = [{name: self._within(parts, deepest) for name in names} for _ in range(count)]
        return found[0] if count == 1 else found

    def _characters(self, one: _Element, size: tuple[int, ...]) -> str:
        """Text, whose lines stand in columns."""
        if one.kind in _TEXT:
            kind = _TEXT[one.kind]
            wide = "" if kind == "utf-8" else "-le" if self.order == "<" else "-be"
            letters = bytes(one.data).decode(kind + wide)
        else:
            letters = "".join(map(chr, self._numbers(one).astype(np.int64).clip(0, 0x10FFFF).tolist()))
        rows = size[0] if size else 1
        return letters if rows <= 1 else "\n".join(letters[k::rows] for k in range(rows))

    def _sparse(self, parts: Iterator[_Element], size: tuple[int, ...], complex_ones: bool) -> np.ndarray | Left:
        """A sparse matrix as a whole one."""
        rows, starts, values = (self._numbers(self._next(parts)) for _ in range(3))
        if complex_ones:
            values = values + 1j * self._numbers(self._next(parts), len(values))
        if len(size) != 2 or len(starts) != size[1] + 1:
            raise _Damage("its columns do not begin")
        return whole(values.astype(values.dtype.newbyteorder("=")), rows, starts.astype(np.int64), size[0])
