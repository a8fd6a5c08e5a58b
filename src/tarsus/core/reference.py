"""Named tuples of arrays by reference: a kernel function takes one pointer instead of every field of every array.

Numba passes a tuple by value, each array as seven numbers and more. ``refer`` stores a tuple once, in the entry, and
hands on where it lies; reading an attribute there loads an array's address and shape. All arrays are C-contiguous.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba.core import cgutils, config
from numba.core.datamodel import models
from numba.core.datamodel.registry import register_default
from numba.core.types import Array, Type
from numba.core.typing.templates import AttributeTemplate, infer_getattr
from numba.extending import intrinsic, lower_getattr_generic

_numbers: dict[Any, int] = {}
# members of numba's array structure
_DATA, _SHAPE = 4, 5


class Reference(Type):
    """Type of a reference to a named tuple of that type."""

    def __init__(self, of: Any) -> None:
        self.of = of
        number = _numbers.setdefault(of, len(_numbers))
        super().__init__(
            name=f"Reference({of.instance_class.__name__}{number})"
        )  # short: it is part of every symbol


@register_default(Reference)
class _Model(models.PrimitiveModel):
    def __init__(self, manager: Any, type_: Any) -> None:
        super().__init__(manager, type_, manager.lookup(type_.of).get_value_type().as_pointer())


@infer_getattr
class _Attribute(AttributeTemplate):
    key = Reference

    def generic_resolve(self, reference: Any, name: str) -> Any:
        fields = reference.of.fields
        return reference.of.types[fields.index(name)] if name in fields else None


@lower_getattr_generic(Reference)
def _load(context: Any, builder: Any, type_: Any, pointer: Any, name: str) -> Any:
    """The array with its address and shape; the kernels ask for nothing else of it."""
    place = type_.of.fields.index(name)
    array = type_.of.types[place]
    assert isinstance(array, Array) and array.layout == "C"
    field = cgutils.gep_inbounds(builder, pointer, 0, place)
    value = ir.Constant(context.get_value_type(array), ir.Undefined)
    value = builder.insert_value(value, builder.load(cgutils.gep_inbounds(builder, field, 0, _DATA)), _DATA)
    for d in range(array.ndim):
        length = builder.load(cgutils.gep_inbounds(builder, field, 0, _SHAPE, d))
        value = builder.insert_value(value, length, (_SHAPE, d))
    return value


@intrinsic
def _refer(typingctx, fields):
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return cgutils.alloca_once_value(builder, arguments[0])

    return Reference(fields)(fields), generate


def _itself(fields: Any) -> Any:
    return fields


# A reference to a named tuple, for the functions that the entry calls; it lives as long as the call of the entry.
refer = _itself if config.DISABLE_JIT else _refer
