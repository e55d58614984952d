"""All stages, by name, in the order in which they run: each is the `STAGE` of the module of its name."""

from importlib import import_module

from iowbc.pipeline.stage import Stage
from iowbc.recipe.recipe import PIPELINE

STAGES: dict[str, Stage] = {name: import_module(f"iowbc.stages.{name.replace('-', '_')}").STAGE for name in PIPELINE}
