"""The base of every recipe section, and which of its values decide results."""

from collections.abc import Mapping, Sequence
from typing import Any

from pydantic import BaseModel, ConfigDict
from pydantic.fields import FieldInfo

COSMETIC: dict[str, Any] = {"cosmetic": True}
"""Extra of a field that changes how a stage is carried out or shown, and none of its results."""


class Section(BaseModel):
    """A frozen part of a recipe that refuses keys it does not know."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, use_attribute_docstrings=True)


def deciding(section: Section) -> dict[str, Any]:
    """What decides results: a section's values as JSON data, without its cosmetic fields, however deep."""
    kept: dict[str, Any] = _deciding(section, section.model_dump(mode="json"))
    return kept


def _deciding(value: Any, plain: Any) -> Any:
    """A value's JSON data without cosmetic fields."""
    if isinstance(value, BaseModel):
        fields = type(value).model_fields.items()
        return {name: _deciding(getattr(value, name), plain[name]) for name, field in fields if not cosmetic(field)}
    if isinstance(value, Mapping):
        return {name: _deciding(item, plain[name]) for name, item in value.items()}
    if isinstance(value, Sequence) and not isinstance(value, str):
        return [_deciding(item, below) for item, below in zip(value, plain, strict=True)]
    return plain


def cosmetic(field: FieldInfo) -> bool:
    """Whether a field is marked as cosmetic."""
    return isinstance(field.json_schema_extra, Mapping) and bool(field.json_schema_extra.get("cosmetic"))
