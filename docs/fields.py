"""What a description is made of: each field with its unit, bounds and default, below the docstring of its class."""

from __future__ import annotations

from typing import Any

from pydantic.fields import FieldInfo
from sphinx.application import Sphinx

from tarsus.base.messages import bounds_text
from tarsus.base.spec import Description
from tarsus.base.units import format_quantity


def line(name: str, field: FieldInfo) -> str:
    """A field as an item of a list."""
    extra = field.json_schema_extra if isinstance(field.json_schema_extra, dict) else {}
    unit = extra.get("unit")
    said = f"* ``{name}``"
    if isinstance(unit, str):
        said += f" [{unit}]{bounds_text(extra)}"
    if field.description:
        said += f": {field.description}"
    if field.is_required():
        return said + "; required."
    value = field.get_default(call_default_factory=not field.default_factory_takes_validated_data)
    if isinstance(value, float) and isinstance(unit, str):
        value = format_quantity(value, unit)
    if value == "":
        return said + "; empty by default."
    return said + (f"; ``{value}`` by default." if isinstance(value, (str, float, int, bool)) else ".")


def add_fields(app: Sphinx, what: str, name: str, obj: Any, options: Any, lines: list[str]) -> None:
    """Append the fields of a description to its docstring."""
    if what == "class" and isinstance(obj, type) and issubclass(obj, Description) and obj.model_fields:
        lines += ["", "Fields:", "", *(line(*item) for item in obj.model_fields.items()), ""]


def setup(app: Sphinx) -> dict[str, bool]:
    """Listen for docstrings, after they were read."""
    app.connect("autodoc-process-docstring", add_fields, priority=900)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
