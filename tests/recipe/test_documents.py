"""YAML is read as what it looks like, with the place of every value."""

import pytest

from iowbc.errors import RecipeError
from iowbc.recipe.reading.document import leaves, plain, read_document


def value_of(text: str) -> object:
    return plain(read_document(f"a: {text}", "file.yaml"))["a"]  # type: ignore[index, call-overload]


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1e-3", 0.001),
        ("1E5", 100000.0),
        (".5", 0.5),
        ("-2", -2),
        ("010", 10),
        ("0x1f", 31),
        ("1:30", "1:30"),
        ("on", "on"),
        ("no", "no"),
        ("true", True),
        ("~", None),
        ("2026-11-21", "2026-11-21"),
        ("'1'", "1"),
        ("[1, 2.0]", [1, 2.0]),
    ],
)
def test_a_scalar_means_what_it_looks_like(text: str, value: object) -> None:
    assert value_of(text) == value
    assert type(value_of(text)) is type(value)


def test_every_value_knows_the_line_and_column_of_its_key() -> None:
    tree = read_document("a: 1\nb:\n  c: 2\n  d: [3,\n      4]\n", "file.yaml")
    places = {".".join(path): leaf.place for path, leaf in leaves(tree)}
    assert places == {
        "a": "file.yaml:1:1",
        "b.c": "file.yaml:3:3",
        "b.d.0": "file.yaml:4:7",
        "b.d.1": "file.yaml:5:7",
    }


def test_all_duplicate_keys_are_named_with_both_places() -> None:
    with pytest.raises(RecipeError) as caught:
        read_document("a: 1\nb: 2\na: 3\nb: 4\n", "file.yaml")
    assert [problem.place for problem in caught.value.problems] == ["file.yaml:3:1", "file.yaml:4:1"]
    assert "first at file.yaml:1:1" in str(caught.value)


def test_a_syntax_error_names_its_place() -> None:
    with pytest.raises(RecipeError, match=r"file\.yaml:2:\d+: not valid YAML"):
        read_document("a: 1\n b: 2\n", "file.yaml")


def test_tags_that_would_build_objects_are_refused() -> None:
    with pytest.raises(RecipeError, match="not allowed in a recipe"):
        read_document("a: !!python/object/apply:os.system ['true']\n", "file.yaml")
    with pytest.raises(RecipeError, match="not allowed in a recipe"):
        read_document("a: !!binary aGVsbG8=\n", "file.yaml")


def test_aliases_that_contain_themselves_or_multiply_are_refused() -> None:
    with pytest.raises(RecipeError, match="alias"):
        read_document("a: &a [*a]\n", "file.yaml")
    bomb = "a0: &a0 [1, 1, 1, 1, 1, 1, 1, 1, 1, 1]\n"
    bomb += "".join(f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 10)}]\n" for n in range(1, 7))
    with pytest.raises(RecipeError, match="far too many"):
        read_document(bomb, "file.yaml")


def test_a_deeply_nested_file_is_refused_before_it_overflows_the_parser() -> None:
    for text in ("[" * 100_000, "a: " + "{a: " * 100_000, "- " * 50_000 + "a"):
        with pytest.raises(RecipeError, match=r"nested more than 40 deep|not valid YAML"):
            read_document(text, "file.yaml")
