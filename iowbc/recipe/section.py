"""Base class of the recipe sections, and the choice of the values that enter cache keys."""

import ast
import functools
import inspect
import itertools
import re
import textwrap
from collections.abc import Iterator, Mapping, Sequence
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, GetJsonSchemaHandler, model_validator
from pydantic.fields import FieldInfo
from pydantic.json_schema import JsonSchemaValue
from pydantic.types import NonNegativeFloat, PositiveFloat
from pydantic_core import CoreSchema

from iowbc.errors import shown

COSMETIC: dict[str, Any] = {"cosmetic": True}
"""Marks a field that changes how a stage is run or shown, but none of its results; it is not part of the key."""
LATER: dict[str, Any] = {"later": True}
"""Marks a field that was added after artifacts were published. Its default is the earlier behaviour and is not part of
the key, so that the keys of those artifacts stay valid."""
Problems = Iterator[tuple[str, str]]
"""Inconsistent values of a recipe: pairs of a dotted path and a message."""


def in_order(ends: tuple[float, float]) -> tuple[float, float]:
    """The lower and upper end of a range. Raises ValueError if the lower end is above the upper end."""
    if ends[0] > ends[1]:
        raise ValueError(f"the lower end {ends[0]:g} is above the upper end {ends[1]:g}")
    return ends


def ascending(values: tuple[float, ...]) -> tuple[float, ...]:
    if any(low >= high for low, high in itertools.pairwise(values)):
        raise ValueError(f"must ascend without repetition, got {list(values)}")
    return values


def _distinct(values: tuple[Any, ...]) -> tuple[Any, ...]:
    if len(set(values)) != len(values):
        raise ValueError(f"must differ, or trials would count more than once; got {list(values)}")
    return values


Range = Annotated[tuple[float, float], AfterValidator(in_order)]
"""Lower and upper end."""
Ascending = Annotated[tuple[PositiveFloat, ...], AfterValidator(ascending), Field(min_length=1)]
"""Positive values that ascend without repetition."""
Masses = Annotated[tuple[NonNegativeFloat, ...], AfterValidator(ascending)]
"""Masses [kg] that ascend without repetition."""
Distinct = AfterValidator(_distinct)
"""Marks tuples whose values must differ from each other."""
PositiveRange = Annotated[tuple[PositiveFloat, PositiveFloat], AfterValidator(in_order)]
NonNegativeRange = Annotated[tuple[NonNegativeFloat, NonNegativeFloat], AfterValidator(in_order)]
Share = Annotated[float, Field(ge=0, le=1)]
Vector = tuple[float, float, float]
HiddenLayers = Annotated[tuple[Annotated[int, Field(gt=0, le=16_384)], ...], Field(max_length=16)]
"""Units of the hidden layers of a network."""
ARTIFACT_NAME = r"^([0-9a-f]{8,64}|.+\.ya?ml)$"
ArtifactName = Annotated[str, Field(pattern=ARTIFACT_NAME, max_length=300)]
"""Artifact of another recipe: that recipe's file, or the first characters (8 or more) of the artifact's key."""
OWN_NAME = "[a-z][a-z0-9_]{0,31}"
"""Pattern of the name of a custom scene or reward term."""
CustomName = Annotated[str, Field(pattern=f"^{OWN_NAME}$")]


class Section(BaseModel):
    """Immutable part of a recipe; unknown keys are an error."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)
    withdrawn: ClassVar[Mapping[str, Any]] = {}
    """Fields of an earlier version that entered no key, with the value whose behaviour remains; resolved recipes of
    artifacts still give that value."""
    withdrawn_from_key: ClassVar[Mapping[str, Any]] = {}
    """The same for fields that entered the key, which still contains the value."""

    @property
    def idle(self) -> bool:
        """True if this entry of a mapping has no effect; such an entry is not part of the key."""
        return False

    def problems(self) -> Problems:
        """Inconsistent values: pairs of a dotted path relative to this section (empty: itself) and a message."""
        return iter(())

    @model_validator(mode="before")
    @classmethod
    def _without_withdrawn(cls, given: Any) -> Any:
        """The values without withdrawn fields. Raises ValueError for one with another value."""
        withdrawn = {**cls.withdrawn, **cls.withdrawn_from_key}
        if not isinstance(given, Mapping) or not withdrawn.keys() & given.keys():
            return given
        for name, value in withdrawn.items():
            if given.get(name, value) != value:
                raise ValueError(f"{name} was withdrawn; its behaviour is that of {shown(value)}: remove it")
        return {name: value for name, value in given.items() if name not in withdrawn}

    @model_validator(mode="after")
    def _check_consistency(self) -> Self:
        if found := tuple(self.problems()):
            raise InconsistentValues(found)
        return self

    @classmethod
    def __get_pydantic_json_schema__(cls, core: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        """Use the attribute docstrings as descriptions of the fields."""
        schema = handler(core)
        fields = handler.resolve_ref_schema(schema).get("properties", {})
        for name, sentence in sentences(cls).items():
            if name in fields:
                fields[name]["description"] = sentence
        return schema


class Interval(Section):
    """A closed range of values."""

    low: float
    """Smallest value."""
    high: float
    """Largest value."""

    def problems(self) -> Problems:
        if self.low > self.high:
            yield "", f"low ({self.low}) is above high ({self.high})"


class NamedEntries(Section, extra="allow"):
    """Mapping of names to entries of one type: built-in entries are fields, and a recipe may add custom ones, whose
    type is the annotation of `__pydantic_extra__`."""

    @property
    def names(self) -> tuple[str, ...]:
        """All names, custom ones last."""
        return (*type(self).model_fields, *self.own)

    @property
    def own(self) -> tuple[str, ...]:
        """Names of the custom entries, alphabetically."""
        return tuple(self.model_extra or ())

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        """Sorts the custom entries: keys do not know their order in the file, so it must not decide anything."""
        object.__setattr__(self, "__pydantic_extra__", dict(sorted((self.model_extra or {}).items())))
        return self

    def problems(self) -> Problems:
        for name in self.own:
            if not re.fullmatch(OWN_NAME, name):
                yield "", f"{name!r} is no name: one begins with a letter and has up to 32 of a-z, 0-9 and _"
            if hasattr(type(self), name):
                yield "", f"{name!r} is a word that sections have a use of their own for; take another"


class Encoder(Section):
    """Network that encodes the observation history H_t as a latent vector."""

    encoder: Literal["mlp"] = "mlp"
    """Multilayer perceptron over the whole history. If the teacher is symmetric by construction, so is the student:
    the encoder has half the latent's size and is applied to the history and to its mirror image."""
    frame_features: int = Field(default=32, ge=1, le=16_384)
    """Features to which each observation of the history is projected, with shared weights."""
    latent: int = Field(default=64, ge=1, le=16_384)
    """Size of the latent vector. It is even if the student is symmetric by construction: mirroring swaps its halves."""


@functools.cache
def sentences(section: type[BaseModel]) -> dict[str, str]:
    """Attribute docstrings of a section and its bases, by field name; of a subsection without one, its own first part.
    They are read on demand: pydantic's `use_attribute_docstrings` reads all sources whenever a command starts."""
    bases = [base for base in section.__bases__ if issubclass(base, BaseModel) and base is not BaseModel]
    (definition,) = ast.parse(textwrap.dedent(inspect.getsource(section))).body
    assert isinstance(definition, ast.ClassDef)
    found = {name: sentence for base in bases for name, sentence in sentences(base).items()}
    for pair in itertools.pairwise(definition.body):
        match pair:
            case ast.AnnAssign(target=ast.Name(id=name)), ast.Expr(value=ast.Constant(value=str(text))):
                found[name] = inspect.cleandoc(text)
    for name, field in section.model_fields.items():
        kind = field.annotation
        if name not in found and isinstance(kind, type) and issubclass(kind, Section):
            found[name] = inspect.cleandoc(kind.__doc__ or "").split("\n\n")[0]
    return found


def marked_fields(section: Section, path: str, mark: Any) -> Iterator[tuple[str, Any]]:
    """Dotted path and value of every field below a section whose type is annotated with `mark`."""
    fields = type(section).model_fields
    for name in (*fields, *(section.model_extra or ())):
        value, here = getattr(section, name), f"{path}.{name}"
        if name in fields and mark in fields[name].metadata:
            yield here, value
        items = [(f"{here}.{number}", item) for number, item in enumerate(value)] if isinstance(value, tuple) else []
        for place, item in ((here, value), *items):
            if isinstance(item, Section):
                yield from marked_fields(item, place, mark)


class InconsistentValues(ValueError):
    """Inconsistent values of a section; see `Section.problems`."""

    def __init__(self, problems: tuple[tuple[str, str], ...]) -> None:
        self.problems = problems
        super().__init__("; ".join(f"{path}: {text}" if path else text for path, text in problems))


def deciding(section: Section) -> dict[str, Any]:
    """The values of a section that enter its key, as JSON data. At every depth, COSMETIC fields, LATER fields at their
    default and idle entries are left out."""
    return _deciding(section, section.model_dump(mode="json"))


def _deciding(value: Any, plain: Any) -> Any:
    if isinstance(value, Section):
        fields = type(value).model_fields.items()
        kept = [name for name, field in fields if not _left_out(field, getattr(value, name))]
        kept += value.model_extra or ()
        return {name: _deciding(getattr(value, name), plain[name]) for name in kept} | {**value.withdrawn_from_key}
    if isinstance(value, Mapping):
        return {name: _deciding(item, plain[name]) for name, item in _acting(value).items()}
    if isinstance(value, Sequence) and not isinstance(value, str):
        return [_deciding(item, below) for item, below in zip(value, plain, strict=True)]
    return plain


def _acting(value: Any) -> Any:
    """A mapping without its idle entries; any other value unchanged."""
    if not isinstance(value, Mapping):
        return value
    return {name: item for name, item in value.items() if not (isinstance(item, Section) and item.idle)}


def _left_out(field: FieldInfo, value: Any) -> bool:
    marks = field.json_schema_extra if isinstance(field.json_schema_extra, Mapping) else {}
    if marks.get("later"):
        return bool(_acting(value) == field.get_default(call_default_factory=True))
    return bool(marks.get("cosmetic"))
