"""`iowbc publish`: put a recipe's finished artifacts into the repository, so that a fresh clone starts from them."""

from collections.abc import Mapping

from rich.console import Console

from iowbc.commands.request import Request, prepared, recipes
from iowbc.commands.results import shown_path
from iowbc.errors import UsageError
from iowbc.pipeline.console.wording import size
from iowbc.pipeline.stage import Stage
from iowbc.pipeline.store.publishing import publish, published_size
from iowbc.pipeline.writability import require_writable_runs


def publish_recipe(request: Request, registry: Mapping[str, Stage], console: Console) -> None:
    """Copy what the recipe's stages have to `runs/published/` and verify it. Raises `UsageError` where one has not run.

    Code that changed since an artifact was made is no obstacle, and is said.
    """
    steps = [step for loaded in recipes(request) for step in prepared(loaded, request, registry)[0].plan()]
    missing = [step.stage.name for step in steps if not step.cached]
    if missing:
        raise UsageError(f"{', '.join(missing)}: not finished for this recipe; to finish: {request.command([])}")
    require_writable_runs(request.runs)
    steps = list({step.key: step for step in steps}.values())
    for step in steps:
        assert step.artifact is not None
        copy = step.artifact if step.artifact.published else publish(request.runs, step.artifact)
        left_out = ", ".join(copy.manifest.omitted)
        notes = [f"without {left_out}"] if left_out else []
        text = "; ".join([f"{step.stage.name}: {shown_path(copy.folder)} ({size(copy.size)})", *notes, *step.notes])
        console.print(text, markup=False, highlight=False, soft_wrap=True)
    console.print(f"{size(published_size(request.runs))} are published in all", highlight=False)
