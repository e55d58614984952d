"""MAPPO and HAPPO on a game of two agents: decentralised policies, one centralised value network."""

from collections import defaultdict
from collections.abc import Mapping, Sequence

import numpy as np
import torch
from torch import Tensor

from iowbc.arrays import Array, Indices, Keys
from iowbc.learning.checkpoint import Arrays, prefixed, under
from iowbc.learning.gaussian import divergence, entropy, log_density
from iowbc.learning.policy import VALUE_GAIN
from iowbc.learning.ppo import adapted, explained_variance
from iowbc.learning.rollout import advantages
from iowbc.recipe.skill.learning import SkillLearning
from iowbc.skill.game import HUMAN, ROBOT, Observed, TransportGame
from iowbc.skill.trained import Trained, mean_actions

IMITATION_BATCH = 1024
"""Batch size of the imitation, sampled from all data so far."""


class SkillTraining:
    """Training of robot and human, one update at a time; see `iowbc.stages.training`.

    Both policies start with zero output: the nominal command, and a cooperative human. The human policy learns from its
    own episodes; the others have scripted humans.
    """

    def __init__(self, settings: SkillLearning, game: TransportGame, seed: int) -> None:
        torch.manual_seed(seed)
        self.settings, self.game, self.seed = settings, game, seed
        self.steps, self.planned = 0, settings.steps
        sizes, rate = game.observation_sizes, settings.learning_rate
        self.agents = {
            name: Trained(sizes[name], game.action_sizes[name], settings, 0.0, rate) for name in (ROBOT, HUMAN)
        }
        seen = sizes[ROBOT] if settings.algorithm == "ppo" else game.state_size
        self.critic = Trained(seen, 1, settings, VALUE_GAIN, settings.value_learning_rate)
        self.trained = {**self.agents, "critic": self.critic}
        self.imitated = self._nothing_imitated()
        """Imitation dataset: the robot's observations and privileged actions."""

    def _nothing_imitated(self) -> dict[str, Tensor]:
        sizes = {"observation": self.game.observation_sizes[ROBOT], "action": self.game.action_sizes[ROBOT]}
        return {name: torch.zeros(0, size) for name, size in sizes.items()}

    @property
    def agent_share(self) -> float:
        """Fraction of the episodes in which the learnt human acts."""
        alone = self.settings.algorithm == "ppo" or self.steps < self.settings.scripted_steps
        return 0.0 if alone else self.settings.learnt_share

    def update(self) -> dict[str, float]:
        """One rollout of every game and its gradient steps; returns their metrics."""
        samples, figures = self._collect()
        self.steps += self.game.n * self.settings.rollout
        return figures | self._learn(samples)

    def _seeds(self, steps: int) -> Keys:
        """Seeds of the rollout that begins after some steps."""
        return np.random.default_rng([self.seed, steps]).integers(2**63, size=self.game.n, dtype=np.uint64)

    def _judged(self, observed: Observed) -> Array:
        return observed.observations[ROBOT] if self.settings.algorithm == "ppo" else observed.state

    def _collect(self) -> tuple[dict[str, Tensor], dict[str, float]]:
        """A rollout: samples by name, flattened, and metrics of its episodes."""
        settings, game = self.settings, self.game
        if self.steps:
            self._move()
        self.critic.normalization.discounted[:] = 0.0
        observed = game.reset(self._seeds(self.steps), self.agent_share)
        kept: dict[str, list[Array]] = defaultdict(list)
        cut: list[tuple[int, Indices, Array]] = []
        episodes: list[dict[str, Array]] = []
        for step in range(settings.rollout):
            now = {**observed.observations, "critic": self._judged(observed)}
            now |= {"learnt": game.human_acts.copy(), "privileged": game.privileged_actions}
            actions = self._explored(observed)
            outcome = game.step({name: np.clip(action, -1.0, 1.0) for name, action in actions.items()})
            ended = outcome.terminated | outcome.truncated
            now |= {"reward": self.critic.normalization.reward(outcome.reward, ended), "ended": ended}
            for name, values in (now | {f"{name}/action": action for name, action in actions.items()}).items():
                kept[name].append(values)
            if (places := np.flatnonzero(outcome.truncated & ~outcome.terminated)).size:
                cut.append((step, places, self._judged(outcome.final)[places]))
            episodes.append({**outcome.figures, "learnt": now["learnt"][ended]})
            observed = outcome.observed
        rows = {name: np.stack(values) for name, values in kept.items()}
        if not self.steps:  # policies with an output of zero do not depend on it
            self._update_statistics(rows)
            self._move()
        prepared = {name: each.prepared(rows[name]) for name, each in self.trained.items()}
        for step, places, behind in cut:
            rows["reward"][step, places] += settings.gamma * self._values(behind)
        with torch.inference_mode():
            value = self.critic.network.body(prepared["critic"])[..., 0].numpy()
        last = self._values(self._judged(observed))
        advantage = advantages(rows["reward"], rows["ended"], value, last, settings.gamma, settings.gae_lambda)
        arrays = {"advantage": advantage, "target": advantage + value, "value": value, "robot/raw": rows[ROBOT]}
        arrays |= {name: rows[name] for name in ("learnt", "privileged")}
        samples = {name: torch.from_numpy(values) for name, values in arrays.items()}
        samples["critic/input"] = prepared["critic"]
        for name, agent in self.agents.items():
            action = torch.from_numpy(rows[f"{name}/action"])
            with torch.inference_mode():
                mean = agent.network.body(prepared[name])
                density = log_density(action, mean, agent.log_std)
            own = {"input": prepared[name], "action": action, "mean": mean, "log_density": density}
            samples |= {f"{name}/{part}": values for part, values in own.items()}
        if self.steps:
            self._update_statistics(rows)
        return {name: values.flatten(0, 1).clone() for name, values in samples.items()}, _of_episodes(episodes)

    def _update_statistics(self, rows: Mapping[str, Array]) -> None:
        """Update the normalisation statistics with the networks' inputs, (T, n, k) each."""
        for name, each in self.trained.items():
            each.normalization.observe(rows[name].reshape(-1, rows[name].shape[-1]))

    def _move(self) -> None:
        """Copy the statistics into the networks' normalisers."""
        for each in self.trained.values():
            each.normalization.move(each.network.normalizer)

    def _explored(self, observed: Observed) -> dict[str, Array]:
        found = {}
        with torch.inference_mode():
            for name, agent in self.agents.items():
                mean = agent.network(torch.from_numpy(observed.observations[name]))
                found[name] = (mean + torch.randn_like(mean) * torch.exp(agent.log_std)).numpy()
        return found

    def _values(self, seen: Array) -> Array:
        with torch.inference_mode():
            return np.asarray(self.critic.network(torch.from_numpy(seen))[:, 0].numpy())

    def _learn(self, samples: Mapping[str, Tensor]) -> dict[str, float]:
        explained = {"train/explained_variance": explained_variance(samples["value"], samples["target"])}
        if self.steps <= self.settings.imitation_steps:
            found = {"imitation_error": self._imitate(samples), "value_loss": self._fit(samples)}
            found["imitation_scale"] = float(samples["privileged"].square().mean())
            return explained | {f"train/{name}": value for name, value in found.items()}
        self.imitated = self._nothing_imitated()
        learning = [ROBOT, HUMAN] if bool(samples["learnt"].any()) else [ROBOT]
        order = [learning[place] for place in torch.randperm(len(learning))]
        self._factor = torch.ones(len(samples["target"]))
        figures: dict[str, float] = {}
        for group in [[name] for name in order] if self.settings.algorithm == "happo" else [order]:
            figures |= self._improve(group, samples)
        figures["train/value_loss"] = self._fit(samples)
        return explained | figures

    def _batches(self, count: int) -> list[Tensor]:
        epochs, parts = self.settings.epochs, self.settings.minibatches
        return [places for _ in range(epochs) for places in torch.randperm(count).chunk(parts)]

    def _improve(self, names: Sequence[str], samples: Mapping[str, Tensor]) -> dict[str, float]:
        """Gradient steps of these policies; with HAPPO, the factor is then multiplied by their probability ratios."""
        figures: dict[str, float] = {}
        for name in names:
            agent = self.agents[name]
            acting = torch.ones_like(samples["learnt"]) if name == ROBOT else samples["learnt"]
            places = torch.nonzero(acting)[:, 0]
            own = {part: samples[f"{name}/{part}"][places] for part in ("input", "action", "mean", "log_density")}
            advantage = samples["advantage"][places]
            advantage = (advantage - advantage.mean()) / (advantage.std() + 1e-8) * self._factor[places]
            before = agent.log_std.detach().clone()
            shares = []
            for batch in self._batches(len(places)):
                loss, share = self._loss(agent, {part: value[batch] for part, value in own.items()}, advantage[batch])
                agent.descend(loss)
                with torch.no_grad():
                    agent.log_std.clamp_(min=float(np.log(self.settings.std_floor)))
                shares.append(share)
            with torch.no_grad():
                mean = agent.network.body(own["input"])
                kl = float(divergence(own["mean"], before, mean, agent.log_std).mean())
                if self.settings.algorithm == "happo":
                    density = log_density(own["action"], mean, agent.log_std)
                    self._factor[places] *= torch.exp(density - own["log_density"])
            found = {"kl": kl, "clip_share": float(np.mean(shares)), "learning_rate": agent.rate}
            found["std"] = float(torch.exp(agent.log_std.detach()).mean())
            figures |= {f"{name}/{figure}": value for figure, value in found.items()}
            agent.rate = adapted(agent.rate, kl, self.settings)
        return figures

    def _loss(self, agent: Trained, own: Mapping[str, Tensor], advantage: Tensor) -> tuple[Tensor, float]:
        """PPO's clipped loss of a policy, and the share of samples that are clipped."""
        clip = self.settings.clip
        density = log_density(own["action"], agent.network.body(own["input"]), agent.log_std)
        ratio = torch.exp(density - own["log_density"])
        loss = -torch.min(advantage * ratio, advantage * torch.clamp(ratio, 1.0 - clip, 1.0 + clip)).mean()
        share = float(((ratio.detach() - 1.0).abs() > clip).float().mean())
        return loss - self.settings.entropy * entropy(agent.log_std), share

    def _fit(self, samples: Mapping[str, Tensor]) -> float:
        """Gradient steps of the value network; returns its mean squared error."""
        losses = []
        for batch in self._batches(len(samples["target"])):
            value = self.critic.network.body(samples["critic/input"][batch])[:, 0]
            loss = torch.nn.functional.mse_loss(value, samples["target"][batch])
            self.critic.descend(loss)
            losses.append(float(loss.detach()))
        return float(np.mean(losses))

    def _imitate(self, samples: Mapping[str, Tensor]) -> float:
        """Gradient steps of the robot's policy towards its privileged actions in all rollouts so far; returns the mean
        squared error in the newest rollout, before the steps."""
        robot, settings = self.agents[ROBOT], self.settings
        with torch.inference_mode():
            error = float(torch.nn.functional.mse_loss(samples[f"{ROBOT}/mean"], samples["privileged"]))
        newest = {"observation": samples[f"{ROBOT}/raw"], "action": samples["privileged"]}
        self.imitated = {name: torch.cat([self.imitated[name], values]) for name, values in newest.items()}
        robot.rate, before = settings.imitation_rate, robot.rate
        for _ in range(settings.imitation_gradient_steps):
            batch = torch.randint(len(self.imitated["action"]), (IMITATION_BATCH,))
            action = robot.network(self.imitated["observation"][batch])
            robot.descend(torch.nn.functional.mse_loss(action, self.imitated["action"][batch]))
        robot.rate = before
        return error

    def golden_observations(self, decisions: int) -> Array:
        """Observations, (decisions x n, k), of the robots in the last rollout's first decisions, with mean actions."""
        seeds, found = self._seeds(self.steps - self.game.n * self.settings.rollout), list[Array]()
        observed = self.game.reset(seeds)
        for _ in range(decisions):
            found.append(observed.observations[ROBOT])
            networks = {name: agent.network for name, agent in self.agents.items()}
            actions = mean_actions(networks, observed.observations, self.game.action_sizes)
            observed = self.game.step(actions).observed
        return np.concatenate(found)

    def arrays(self) -> Arrays:
        """Training state for resuming, between two updates."""
        whole: Arrays = {"steps": np.array([self.steps]), "random/torch": torch.get_rng_state().numpy()}
        whole |= prefixed("imitated", {name: values.numpy() for name, values in self.imitated.items()})
        for name, each in self.trained.items():
            whole |= prefixed(name, each.arrays())
        return whole

    def restore(self, arrays: Mapping[str, Array]) -> None:
        for name, each in self.trained.items():
            each.restore(under(name, arrays))
        self.steps = int(arrays["steps"][0])
        self.imitated = {name: torch.from_numpy(np.array(of)) for name, of in under("imitated", arrays).items()}
        torch.set_rng_state(torch.from_numpy(np.array(arrays["random/torch"])))


def _of_episodes(ended: Sequence[Mapping[str, Array]]) -> dict[str, float]:
    """Means over the ended episodes, by kind of human."""
    columns = {name: np.concatenate([np.asarray(each[name]) for each in ended]) for name in ended[0]}
    columns = {name: values.astype(np.float64) for name, values in columns.items() if values.dtype.kind in "fib"}
    learnt = columns.pop("learnt") > 0.0
    means: dict[str, float] = {}
    for kind, of in (("scripted", ~learnt), ("learnt", learnt)):
        if of.any():
            means |= {f"{kind}/{name}": float(values[of].mean()) for name, values in columns.items()}
    return means
