"""References to named tuples for compiled code: an argument is one pointer, and only fields that are read are loaded.

numba passes a tuple by value. Each call with a scene, and each variable, would copy some four hundred numbers, and LLVM
would spend most of its time on these copies. A reference has the fields of its tuple; a field that is itself a named
tuple is a reference, too. In plain Python, references are the tuples themselves.
"""

from __future__ import annotations

import operator

from llvmlite import ir
from numba.core.cgutils import alloca_once_value
from numba.core.datamodel.models import PrimitiveModel
from numba.core.imputils import lower_getattr_generic
from numba.core.typing.templates import AttributeTemplate, infer_getattr
from numba.extending import intrinsic, overload, register_model

from texvol.ray_casting.common.compiling import config, same, types, without_counts


class Reference(types.Type):
    """The type of a pointer to a named tuple."""

    def __init__(self, target):
        self.target = target
        super().__init__(name=f"Reference({target})")

    def field(self, name):
        """Return the type of a field: of a named tuple, a reference."""
        kind = self.target.types[self.target.fields.index(name)]
        return Reference(kind) if isinstance(kind, types.BaseNamedTuple) else kind


@register_model(Reference)
class _Pointer(PrimitiveModel):
    def __init__(self, manager, kind):
        super().__init__(manager, kind, manager.lookup(kind.target).get_value_type().as_pointer())


@infer_getattr
class _FieldTypes(AttributeTemplate):
    key = Reference

    def generic_resolve(self, reference, name):
        return reference.field(name) if name in reference.target.fields else None


@lower_getattr_generic(Reference)
def _field(context, builder, reference, pointer, name):
    number = reference.target.fields.index(name)
    address = builder.gep(pointer, [_index(0), _index(number)], inbounds=True)
    kind = reference.target.types[number]
    if isinstance(kind, types.BaseNamedTuple):
        return address
    return without_counts(context, builder, kind, builder.load(address))


def _index(number):
    return ir.Constant(ir.IntType(32), number)


@intrinsic
def referenced(typing_context, data):
    """Return a reference to a named tuple, valid until the function ends in which it is made; as `uncounted`."""

    def code(context, builder, signature, arguments):
        return alloca_once_value(builder, without_counts(context, builder, signature.args[0], arguments[0]))

    return Reference(data)(data), code


class References(Reference):
    """The type of a pointer to the first of several named tuples of one type."""

    def __init__(self, target):
        super().__init__(target)
        self.name = f"References({target})"  # by which numba compares types


register_model(References)(_Pointer)


@intrinsic
def references(typing_context, data, count):
    """Return room for references to `count` tuples of the type of `data`, valid as `referenced`; a list in Python."""

    def code(context, builder, signature, arguments):
        return builder.alloca(arguments[0].type, size=arguments[1])

    return References(data)(data, count), code


@intrinsic
def _at(typing_context, data, index):
    def code(context, builder, signature, arguments):
        return builder.gep(arguments[0], [arguments[1]], inbounds=True)

    return Reference(data.target)(data, index), code


@intrinsic
def _write(typing_context, data, index, value):
    def code(context, builder, signature, arguments):
        pointer, index, value = arguments
        builder.store(without_counts(context, builder, signature.args[2], value), builder.gep(pointer, [index]))
        return context.get_dummy_value()

    return types.void(data, index, value), code


@overload(operator.getitem)
def _getitem(data, index):
    if isinstance(data, References):
        return lambda data, index: _at(data, index)
    return None


@overload(operator.setitem)
def _setitem(data, index, value):
    if isinstance(data, References):
        return lambda data, index, value: _write(data, index, value)
    return None


if config.DISABLE_JIT:  # type: ignore[attr-defined]
    referenced = same  # type: ignore[assignment]

    def references(data, count):  # type: ignore[misc]
        return [data] * count
