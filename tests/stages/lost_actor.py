"""Trains the smallest teacher with two rollout actors on Ray, one of which is killed after the first update."""

import sys
from dataclasses import replace
from pathlib import Path

import psutil
from local_nodes import connected_nodes, spread_over
from stage_jobs import make_job
from training_jobs import small_recipe

from iowbc.recipe.execution import Execution
from iowbc.stages import teacher


def main(folder: Path) -> None:
    recipe = small_recipe().model_copy(update={"execution": Execution(rollout_actors=2)})
    killed: list[int] = []

    def after_an_update() -> bool:
        if not killed:
            every = psutil.Process().children(recursive=True)
            killed.extend(process.pid for process in every if process.name().startswith("ray::ActorHost"))
            psutil.Process(killed[0]).kill()
        return False

    with connected_nodes([1, 1]) as cluster:
        job = make_job(folder, recipe, workers=0, interrupted=after_an_update)
        teacher.STAGE.run(replace(job, spread=spread_over(cluster, [job.robot])))
    print(f"{len(killed)} actors, one of them killed")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
