"""What the learning curves are called in figures, with units."""

TITLES = {
    "episode_seconds": "length of an episode [s]",
    "terminations/fallen": "episodes that end in a fall [share]",
    "terminations/dropped": "episodes that end in a drop [share]",
    "reward": "reward [1/s]",
    "curriculum_level": "level, mean of all axes",
    "check/score": "score of the check",
    "check/survived": "trials of the check survived [share]",
    "check/E_v": "E_v in the check [m/s]",
    "check/transport": "way covered in the check [share]",
    "train/kl": "KL divergence of an update [nat]",
    "train/clip_share": "samples clipped [share]",
    "train/learning_rate": "step size",
    "train/std": "standard deviation of the action",
    "train/explained_variance": "variance explained by the value [share]",
    "steps_per_second": "environment steps a second [1/s]",
    "kl": "KL divergence from the teacher [nat]",
    "kl_at_shared_std": "KL divergence at the teacher's std [nat]",
    "auxiliary_error": "error of mass and velocity read [std]",
    "std": "standard deviation of the student",
    "action_rmse": "difference from the teacher's action",
    "action_agreement": "agreement with the teacher [share]",
    "teacher_share": "environments that the teacher drives [share]",
}
"""By the name under which a figure is recorded."""
FAMILIES = {
    "level/": "level of {}",
    "falls/": "falls, {} [share of episodes]",
    "reward/": "reward of {} [1/s]",
}
"""By the beginning of the name; the rest takes the place of the braces."""


def title_of(name: str) -> str:
    """Title of a panel; a name that is not listed is its own."""
    for beginning, title in FAMILIES.items():
        if name.startswith(beginning):
            return title.format(name.removeprefix(beginning))
    return TITLES.get(name, name)
