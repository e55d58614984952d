"""Takes the files that a recipe names into its tree of values."""

from pathlib import Path

from iowbc.errors import Problem, RecipeError, shown
from iowbc.recipe.beside import FileBeside
from iowbc.recipe.reading.document import Located, leaves, located
from iowbc.recipe.reading.validation import models_at


def with_files(tree: Located, folder: Path) -> Located:
    """The tree with each named file as it is now; paths are taken from the recipe's file that says them.

    `folder`: from where those are taken that are said on the command line. Raises `RecipeError`.
    """
    problems = []
    for path, leaf in leaves(tree):
        kinds = [model for model in models_at(path) if issubclass(model, FileBeside)]
        if not kinds or not isinstance(leaf.value, str):
            continue
        below = folder if leaf.place.startswith("--set ") else Path(leaf.place.rsplit(":", 2)[0]).parent
        file = below / leaf.value
        try:
            taken = kinds[0].taken_in(file, leaf.value)
        except ValueError as error:
            problems.append(Problem(leaf.place, f"key '{'.'.join(path)}' = {shown(leaf.value)}: {error}"))
            continue
        tree = _replaced(tree, path, located(taken.model_dump(mode="json"), leaf.place))
    if problems:
        raise RecipeError(problems)
    return tree


def _replaced(tree: Located, path: tuple[str, ...], value: Located) -> Located:
    if not path:
        return value
    assert isinstance(tree.value, dict)
    entries = {**tree.value, path[0]: _replaced(tree.value[path[0]], path[1:], value)}
    return Located(entries, tree.place)
