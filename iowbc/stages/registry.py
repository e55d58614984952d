"""All stages, by name, in the order in which they run."""

from collections.abc import Mapping

from iowbc.pipeline.stage import Stage
from iowbc.stages import distill, evaluate, export, rg_dataset, rg_fit, teacher

STAGES: Mapping[str, Stage] = {
    stage.name: stage
    for stage in (rg_dataset.STAGE, rg_fit.STAGE, teacher.STAGE, distill.STAGE, evaluate.STAGE, export.STAGE)
}
