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
    planners = [prepared(loaded, request, registry)[0] for loaded in recipes(request)]
    steps = [step for planner in planners for step in planner.plan()]
    missing = [step.stage.name for step in steps if not step.cached]
    if missing:
        raise UsageError(f"{', '.join(missing)}: not finished for this recipe; to finish: {request.command([])}")
    require_writable_runs(request.runs)
    notes = {step.key: step.notes for step in steps}
    made = [step.artifact for step in steps]
    started = [found for planner in planners for stage in planner.stages for found in planner.start(stage).values()]
    artifacts = {found.manifest.key: found for found in (*made, *started) if found is not None}
    for key, artifact in artifacts.items():
        copy = artifact if artifact.published else publish(request.runs, artifact)
        left_out = ", ".join(copy.manifest.omitted)
        without = [f"without {left_out}"] if left_out else []
        what = f"{artifact.manifest.stage}: {shown_path(copy.folder)} ({size(copy.size)})"
        text = "; ".join([what, *without, *notes.get(key, ())])
        console.print(text, markup=False, highlight=False, soft_wrap=True)
    console.print(f"{size(published_size(request.runs))} are published in all", highlight=False)
