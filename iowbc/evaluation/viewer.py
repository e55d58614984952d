"""MuJoCo's viewer, in which an episode is played in real time."""

import os
import sys
import time
from collections.abc import Callable

from iowbc.errors import Interrupted, NoDisplay
from iowbc.evaluation.trials.outcome import Outcome
from iowbc.evaluation.trials.rollout import Acting, play_in
from iowbc.sim.rendering.appearance import Appearance
from iowbc.task.vector.vector_env import VectorEnv


def require_display() -> None:
    """Raises NoDisplay where the viewer cannot open a window."""
    if sys.platform == "linux" and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        raise NoDisplay(
            "no display (DISPLAY and WAYLAND_DISPLAY are unset): give --video out.mp4 to make a film instead"
        )


def play_in_viewer(environment: VectorEnv, policy: Acting, interrupted: Callable[[], bool]) -> Outcome:
    """One episode in real time in a window. Raises Interrupted when the window is closed."""
    import mujoco.viewer  # needs a window system as soon as it is imported

    appearance = Appearance(environment.batch.simulation, 0)
    data = appearance.data
    with mujoco.viewer.launch_passive(appearance.model, data, show_left_ui=False, show_right_ui=False) as viewer:
        start = time.monotonic()

        def look(seconds: float) -> None:
            if not viewer.is_running():
                raise Interrupted("the viewer was closed")
            with viewer.lock():
                appearance.update()
                viewer.cam.lookat[:] = data.qpos[:3]
            viewer.sync()
            time.sleep(max(0.0, start + seconds - time.monotonic()))

        return play_in(environment, policy, interrupted, look=look)[0]
