"""`iowbc publish`: put a recipe's finished artifacts into the repository, so that a fresh clone starts from them."""

from typing import Annotated

from rich.filesize import decimal
from typer import Option

from iowbc.commands import options
from iowbc.commands.printed import shown_path, stdout_console, tell
from iowbc.commands.request import Request, planners
from iowbc.errors import UsageError, nearest
from iowbc.pipeline.stage_plan import Options
from iowbc.pipeline.store.runs import Runs, require_writable_runs
from iowbc.pipeline.store.store import Store

LARGEST_REPOSITORY = 30_000_000
"""Maximum size of all published files [bytes], so that cloning stays fast."""


def publish(
    recipe: options.RecipeFile,
    overrides: options.Overrides = None,
    until: options.Until = None,
    without: Annotated[
        list[str] | None,
        Option(
            help="File to leave out (repeatable); state.safetensors is needed only to extend a training.",
            metavar="FILE",
        ),
    ] = None,
    runs: options.RunsFolder = options.RUNS,
) -> None:
    """Copy a recipe's artifacts, and those that it begins from, to `runs/published/`, and verify the copies. Changes of
    code since then are reported but accepted. Raises `UsageError` if a stage has not run, or if no artifact has a file
    in `without`."""
    request, console = Request(recipe, overrides or (), Runs(runs), Options(until)), stdout_console()
    without = without or []
    found = planners(request)
    plans = [planner.plan() for planner in found]
    lacking = [
        f"{planner.loaded.recipe.name} ({', '.join(missing)})"
        for planner, plan in zip(found, plans, strict=True)
        if (missing := [step.stage.name for step in plan if not step.cached])
    ]
    if lacking:
        raise UsageError(f"not finished: {', '.join(lacking)}; to finish: {request.command()}")
    published = request.runs.published
    require_writable_runs(request.runs, request.runs.locks, published, *published.glob("*/"))
    notes = {step.key: step.notes for plan in plans for step in plan}
    chains = [one for planner in found for one in planner.chain()]
    made = [step.artifact for one in chains for step in one.plan()]
    made += [one for each in chains for stage in each.stages for one in each.borrowed(stage).values()]
    artifacts = {one.manifest.key: one for one in made if one is not None}
    names = {name for artifact in artifacts.values() for name in artifact.manifest.files}
    for name in without:
        if name not in names:
            known = nearest(name, names) or f"; files: {', '.join(sorted(names))}"
            raise UsageError(f"--without {name}: no artifact has such a file{known}")
    for key, artifact in artifacts.items():
        to_leave_out = set(without) & set(artifact.manifest.files) - set(artifact.manifest.omitted)
        copy = artifact if artifact.published and not to_leave_out else Store(request.runs).publish(artifact, without)
        omitted = copy.manifest.omitted
        lacks = [f"without {len(omitted)} of {len(copy.manifest.files)} files"] if omitted else []
        what = f"{artifact.manifest.stage}: {shown_path(copy.folder)} ({decimal(copy.size)})"
        changes = () if copy is artifact else notes.get(key, ())
        tell(console, "; ".join([what, *lacks, *changes]))
    size = sum(path.stat().st_size for path in request.runs.published.rglob("*") if path.is_file())
    console.print(f"{decimal(size)} are published in all", highlight=False)
    if size > LARGEST_REPOSITORY:
        limit = decimal(LARGEST_REPOSITORY)
        tell(console, f"warning: a repository should carry no more than {limit}; remove what is out of date")
