"""Titles of the learning curves in figures and reports, with units."""

TITLES = {
    "episode_seconds": "length of an episode [s]",
    "terminations/fallen": "episodes that end in a fall [share]",
    "episode_return": "reward of an episode",
    "terminations/dropped": "episodes that end in a drop [share]",
    "terminations/diverged": "episodes that diverge [share]",
    "terminations/lagging": "episodes that end for lagging [share]",
    "terminations/time_limit": "episodes that reach their end [share]",
    "tracking": "tracking of the command [share of the best]",
    "infeasible_pushes": "infeasible pushes [share]",
    "divergences": "simulations that diverged",
    "rollbacks": "returns to the best policy",
    "reward": "reward [1/s]",
    "curriculum_level": "level, mean of all axes",
    "check/score": "score of the check",
    "check/survived": "trials of the check survived [share]",
    "check/succeeded": "trials of the check that succeed [share]",
    "check/upright": "time upright in the check [share]",
    "check/weight_in_hands": "weight in the hands in the check [share]",
    "check/transport": "way covered in the check [share]",
    "check/E_v": "E_v in the check [m/s]",
    "check/E_psi": "E_ψ in the check [rad]",
    "check/E_alpha": "E_α in the check [rad]",
    "check/E_h": "E_h in the check [m]",
    "train/kl": "KL divergence of an update [nat]",
    "train/approx_kl": "KL divergence of an update, sampled [nat]",
    "train/policy_loss": "loss of the policy",
    "train/value_loss": "loss of the value",
    "train/clip_share": "samples clipped [share]",
    "train/learning_rate": "learning rate",
    "train/imitation_error": "difference from the scripted leader's action",
    "train/imitation_scale": "size of the scripted leader's action",
    "train/std": "standard deviation of the action",
    "train/explained_variance": "variance explained by the value [share]",
    "train/gain": "advantage gained by an update, on the next rollout",
    "steps_per_second": "environment steps a second [1/s]",
    "kl": "KL divergence from the teacher [nat]",
    "kl_at_shared_std": "KL divergence at the teacher's std [nat]",
    "auxiliary_error": "mean squared error of what is read from the latent",
    "std": "standard deviation of the student",
    "action_rmse": "difference from the teacher's action",
    "action_agreement": "agreement with the teacher [share]",
    "teacher_share": "environments that the teacher drives [share]",
}
"""Titles by the name of the recorded quantity."""
FAMILIES = {
    "robot/": "{} of the robot's skill",
    "human/": "{} of the human's policy",
    "scripted/": "{}, scripted humans",
    "learnt/": "{}, learnt human",
    "level/": "level of {}",
    "falls/": "falls, {} [share of episodes]",
    "reward/": "reward of {} [1/s]",
    "seconds/": "time of an update, {} [s]",
}
"""Titles by name prefix; the rest of the name replaces the braces."""
ERROR_UNITS = {"velocity": "m/s", "heading": "rad", "height": "m", "pitch": "rad"}
"""Units of `error/<scene>/<standing or walking>/<error>`."""


def title_of(name: str) -> str:
    """Title of a panel; the name itself if it is not listed."""
    family, _, rest = name.partition("/")
    if family == "error" and rest.count("/") == 2:
        scene, kind, error = rest.split("/")
        return f"error of {error}, {scene}, {kind} [{ERROR_UNITS.get(error, '?')}]"
    load, _, figure = rest.rpartition("/")
    if family == "check" and f"check/{figure}" in TITLES and load:
        return f"{TITLES[f'check/{figure}']}, {load.replace('_', ' ')}"
    for beginning, title in FAMILIES.items():
        if name.startswith(beginning):
            return title.format(name.removeprefix(beginning))
    return TITLES.get(name, name)
