"""What of a section decides results."""

from pydantic import Field

from iowbc.recipe.section import COSMETIC, LATER, Section, deciding


class Inner(Section):
    """A part."""

    old: int = 1
    added: float = Field(default=0.5, json_schema_extra=LATER)


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
