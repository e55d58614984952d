"""What of a section decides results."""

from collections.abc import Mapping
from typing import Any, ClassVar

import pytest
from pydantic import Field, ValidationError

from iowbc.recipe.section import COSMETIC, LATER, Section, deciding
from iowbc.recipe.teacher import HistoryNetwork


class Inner(Section):
    """A part."""

    old: int = 1
    added: float = Field(default=0.5, json_schema_extra=LATER)


class Shorter(Inner):
    """The same, once longer."""

    withdrawn: ClassVar[Mapping[str, Any]] = {"gone": 8}
    withdrawn_from_key: ClassVar[Mapping[str, Any]] = {"keyed": "once"}


class Outer(Section):
    """A whole."""

    parts: tuple[Inner, ...] = (Inner(),)
    title: str = Field(default="x", json_schema_extra=COSMETIC)
    more: Inner = Field(default_factory=lambda: Inner(old=2), json_schema_extra=LATER)


def test_a_field_that_came_later_decides_nothing_until_it_departs_from_its_default() -> None:
    assert deciding(Outer()) == {"parts": [{"old": 1}]}
    assert deciding(Outer(parts=(Inner(added=0.7),))) == {"parts": [{"old": 1, "added": 0.7}]}
    assert deciding(Outer(more=Inner(old=3)))["more"] == {"old": 3}
    assert deciding(Outer(more=Inner(old=2, added=0.5), title="y")) == {"parts": [{"old": 1}]}


def test_a_withdrawn_field_may_keep_the_value_whose_behaviour_remains() -> None:
    assert deciding(Shorter.model_validate({"old": 2, "gone": 8})) == {"old": 2, "keyed": "once"}
    assert deciding(Shorter.model_validate({"old": 2, "keyed": "once"})) == {"old": 2, "keyed": "once"}
    with pytest.raises(ValidationError, match="gone was withdrawn; its behaviour is that of 8: remove it"):
        Shorter.model_validate({"gone": 9})
    with pytest.raises(ValidationError, match="Extra inputs"):
        Inner.model_validate({"gone": 8})


def test_the_published_specialist_is_read_without_its_withdrawn_fields() -> None:
    """The resolved recipe of the published teacher of specialists/push.yaml still has them."""
    assert HistoryNetwork.model_validate({"experts": {}, "imitation": 0.1}) == HistoryNetwork()
    with pytest.raises(ValidationError, match="imitation was withdrawn"):
        HistoryNetwork.model_validate({"imitation": 0.2})
