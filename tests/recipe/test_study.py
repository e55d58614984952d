"""A study names its variants, and says what is wrong with it where it stands."""

from pathlib import Path

import pytest

from iowbc.errors import RecipeError
from iowbc.recipe.reading.loading import load_recipe
from iowbc.recipe.reading.study import load_study


def write(folder: Path, text: str, name: str = "paper.yaml") -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def refused(folder: Path, text: str) -> str:
    with pytest.raises(RecipeError) as caught:
        load_study(write(folder, text))
    return str(caught.value)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    write(tmp_path, "seed: 3\n", "full.yaml")
    write(tmp_path, "extends: full.yaml\ntask: {references: {use_rg: false}}\n", "wo_rg.yaml")
    return tmp_path


def test_variants_lie_beside_the_file_and_take_the_overrides(folder: Path) -> None:
    variants = load_study(write(folder, "description: both\nvariants: [full, wo_rg.yaml]\n"), ["eval.trials=2"])
    assert [variant.recipe.name for variant in variants] == ["full", "wo_rg"]
    assert {variant.recipe.eval.trials for variant in variants} == {2}


def test_a_recipe_proper_has_no_variants(folder: Path) -> None:
    assert load_study(folder / "full.yaml") == ()


def test_what_is_wrong_is_named_with_its_place(folder: Path) -> None:
    assert "paper.yaml:1:1: key 'seed': a recipe that names variants holds" in refused(
        folder, "seed: 1\nvariants: [full, wo_rg]\n"
    )
    assert "should be a list of 2 to 100 recipes, not of 1" in refused(folder, "variants: [full]\n")
    assert "should be a list of 2 to 100 recipes, not 'full'" in refused(folder, "variants: full\n")
    assert "not of 20,000" in refused(folder, f"variants: [{'full, ' * 20_000}]\n")
    assert r"'a\x00b' is no recipe's name" in refused(folder, 'variants: [full, "a\\0b"]\n')
    assert "paper.yaml:1:12: key 'variants': 3 is no recipe's name" in refused(folder, "variants: [3, full]\n")
    assert "full is the name of more than one" in refused(folder, "variants: [full, full]\n")
    assert "1:1: key 'name' = 'aaa" in refused(folder, f"name: {65 * 'a'}\nvariants: [full, wo_rg]\n")
    assert "1:1: key 'description': should be a" in refused(folder, "description: [1]\nvariants: [full, wo_rg]\n")


def test_a_variant_that_is_missing_is_told_as_an_extended_recipe_is(folder: Path) -> None:
    write(folder, "extends: quikstart.yaml\n", "mine.yaml")
    text = refused(folder, "variants: [full, nothing, quikstart.yaml]\n")
    first, second = text.splitlines()
    assert first.startswith(f"{folder}/paper.yaml:1:18: recipe {folder}/nothing: no such file; recipes by name: ")
    assert second.startswith(f"{folder}/paper.yaml:1:27: recipe {folder}/quikstart.yaml: no such file; recipes in ")
    assert second.endswith("did you mean 'quickstart.yaml'?")
    with pytest.raises(RecipeError) as caught:
        load_study(write(folder, "variants: [full, mine]\n"))
    assert str(caught.value).endswith(second.partition(": recipe ")[2])


def test_what_a_recipe_extends_may_lie_beside_it_and_be_named_as_variants_are(folder: Path) -> None:
    write(folder, "seed: 9\n", "wo_rg.yaml")  # a name that the package has, too
    assert load_recipe(write(folder, "extends: wo_rg\n", "mine.yaml")).recipe.seed == 9


def test_a_file_whose_name_is_no_recipes_is_told_so(folder: Path) -> None:
    with pytest.raises(RecipeError, match=r"My study\.yaml:1:1: key 'name' = 'my study': up to 64 lower-case letters"):
        load_study(write(folder, "variants: [full, wo_rg]\n", "My study.yaml"))
