"""The base of every recipe section, and which of its values decide results."""

from collections.abc import Mapping, Sequence
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field
from pydantic.fields import FieldInfo

COSMETIC: dict[str, Any] = {"cosmetic": True}
"""Extra of a field that changes how a stage is carried out or shown, and none of its results."""
LATER: dict[str, Any] = {"later": True}
"""Extra of a field that came after artifacts were published. At its default, which is what the program did before, it
decides nothing, so that their keys hold."""

Width = Annotated[int, Field(gt=0, le=16_384)]
"""Units of a hidden layer."""
DEEPEST = 16
"""Hidden layers of the deepest network."""


class Section(BaseModel):
    """A frozen part of a recipe that refuses keys it does not know."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, use_attribute_docstrings=True)


def deciding(section: Section) -> dict[str, Any]:
    """What decides results: a section's values as JSON data, however deep, without its cosmetic fields and without
    later ones at their default."""
    kept: dict[str, Any] = _deciding(section, section.model_dump(mode="json"))
    return kept


def _deciding(value: Any, plain: Any) -> Any:
    if isinstance(value, BaseModel):
        fields = type(value).model_fields.items()
        kept = [name for name, field in fields if not _left_out(field, getattr(value, name))]
        return {name: _deciding(getattr(value, name), plain[name]) for name in kept}
    if isinstance(value, Mapping):
        return {name: _deciding(item, plain[name]) for name, item in value.items()}
    if isinstance(value, Sequence) and not isinstance(value, str):
        return [_deciding(item, below) for item, below in zip(value, plain, strict=True)]
    return plain


def _left_out(field: FieldInfo, value: Any) -> bool:
    marks = field.json_schema_extra if isinstance(field.json_schema_extra, Mapping) else {}
    if marks.get("later"):
        return bool(value == field.get_default(call_default_factory=True))
    return bool(marks.get("cosmetic"))
