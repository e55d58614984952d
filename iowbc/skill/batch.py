"""Games of one process: decisions of robot and human, control steps, rewards and endings."""

from typing import TYPE_CHECKING

import numpy as np

from iowbc import counter_random as random
from iowbc.arrays import Array, Indices, Keys, Mask
from iowbc.control.hand_forces import HandForces
from iowbc.control.skill_observation import YAW, joined, of_object, robot_observation
from iowbc.evaluation.trials.plan import UNDISTURBED
from iowbc.robot.rotations import turned
from iowbc.rollouts.blocks import block_size
from iowbc.sim.objects import measured as shape_of
from iowbc.skill import observation as seen
from iowbc.skill.episodes import CLOCK, KINDS, PERSON, RULES, EpisodeDraws
from iowbc.skill.intentions import Human, NominalCommand, ObjectMotion, open_loop_motion, pursue
from iowbc.skill.lower_layer import LowerLayer
from iowbc.skill.outcomes import FIGURES, EpisodeFigures, GameEnding, ending, internal_force, potential, reward
from iowbc.skill.situation import GameState, Origin, Paths, situation
from iowbc.task.episodes import Episode
from iowbc.task.vector.shared import Buffers

if TYPE_CHECKING:
    from iowbc.skill.setup import GameSetup

NO_LIMIT = 1e6
"""Time limit of the lower layer's episodes [s]: the game ends them."""
CORNERS = np.array([[1.0, 1.0], [1.0, -1.0], [-1.0, -1.0], [-1.0, 1.0]])
ROBOT_ACTIONS, HUMAN_ACTIONS = 11, 5


class GameBatch:
    """n games. `reset` and `step` read the actions from the buffers and write all results to them."""

    def __init__(self, setup: "GameSetup", first: int, last: int, buffers: Buffers) -> None:
        """Games from `first` to `last` (excluded); `buffers` hold only their rows."""
        recipe, self._skill = setup.specification.recipe, setup.skill
        self.buffers, self._games, self._keys = buffers, np.arange(first, last), setup.keys(first, last)
        scenes, plans = setup.scenes[first:last], None if setup.plans is None else setup.plans[first:last]
        episodes = [
            Episode(scene, int(key), NO_LIMIT, UNDISTURBED) for scene, key in zip(scenes, self._keys, strict=True)
        ]
        self.lower = LowerLayer(setup.specification, setup.student, episodes, block_size(setup.count))
        self.n = n = last - first
        period, own = self.lower.period, list(setup.tasks.values())
        self.substeps = round(1.0 / (self._skill.frequency * period))
        """Control steps per decision."""
        worlds = [getattr(recipe.simulation.scenes, scene) for scene in scenes]
        self._pushing = np.array([world.kind == "push" for world in worlds])
        self._corners = np.array([shape_of(world.object).high[:2] for world in worlds])[:, None] * CORNERS
        self.paths = Paths([task.path for task in own])
        self._limit = np.array([round(task.duration * self._skill.frequency) for task in own])
        self.drawn = EpisodeDraws(setup.tasks, scenes, setup.partners, self._skill.goal_known, plans)
        self._nominal = NominalCommand(self._skill, recipe.task.commands, self._pushing)
        self._human = Human(self._skill, n, period)
        self._hands = HandForces(self.lower.robot, self.lower.guidance.references, n, self._skill.robot.history)
        self._figures = EpisodeFigures(n, (int(self._limit.max()) + 1) * self.substeps)
        self._sees_object = recipe.student_sees_object
        self.origin = Origin(np.zeros((n, 3)), np.zeros(n))
        self._episode, self._decisions, self._touched = np.zeros((3, n), np.int64)
        self._total, self._potential = np.zeros((2, n))
        self._wrist_error = np.zeros((n, 2, 3))
        self._action = {"robot": np.zeros((n, ROBOT_ACTIONS)), "human": np.zeros((n, HUMAN_ACTIONS))}
        self._costs, self._jerk = np.zeros((3, n)), np.zeros(n)
        self.hand = np.full((n, 3), np.nan)
        """Hand positions of persons, which pull the handle there, world frame, (n, 3) [m]; NaN lets go."""
        self.now: GameState
        """The games after the last control step."""

    def reset(self, seeds: Keys | None = None, agent_share: float = 0.0) -> None:
        """See `TransportGame.reset`; seeds (n,) reseed all random draws."""
        self.drawn.agent_share = agent_share
        if seeds is not None:
            self._keys = random.environment_key(seeds, np.zeros(self.n, np.int64))
        self.lower.reseed(self._keys)
        self._episode[:] = 0
        for name in ("reward", "terminated", "truncated"):
            self.buffers[name][:] = 0
        self._hands.restart()
        self._begin(np.arange(self.n))
        self._observe()

    def step(self) -> None:
        """One decision of every game, with `substeps` control steps; ended games restart."""
        self.decide()
        for _ in range(self.substeps):
            self.control()
        self.finish_decision()

    def decide(self) -> None:
        action = {name: self.buffers[f"action/{name}"].astype(np.float64).clip(-1.0, 1.0) for name in self._action}
        self._jerk = np.square(action["robot"] - self._action["robot"]).mean(axis=1)
        self._action = action
        self.lower.wanted[:] = self._nominal.with_action(self._nominals, action["robot"])
        led = self._human.of_script(pursue(self._skill.pursuit, self.paths, self.now), self.now)
        blind = self._human.of_script(self._open_loop_motion(self.drawn.pace), self.now)
        scripted = np.where((self.drawn.kind == KINDS.index(CLOCK))[:, None], blind, led)
        acting = led + self._human.of_action(action["human"], self.now)
        self._human.intend(np.where(self.drawn.acts[:, None], acting, scripted))
        self._costs[:] = 0.0

    def control(self) -> None:
        lower, simulation = self.lower, self.lower.simulation
        person = self.drawn.kind == KINDS.index(PERSON)
        if person.any():
            holding = np.isfinite(self.hand).all(axis=1)
            simulation.partner.loose[:] = person & ~holding
            away = np.nan_to_num(self.hand - simulation.partner.aim)
            self._human.reach(person, self.origin.turned(away), self.now)
        lower.human[:] = self._human.advance()
        lower.control()
        self._hands.add(simulation.target, simulation.measured.joint_position, simulation.measured.joint_velocity)
        self.now = self._situation(self.now.covered)
        self._costs += self._costs_now()

    def finish_decision(self) -> None:
        """Reward and endings of the decision; restarts ended games."""
        self._decisions += 1
        lower, buffers, held = self.lower, self.buffers, ~self._pushing
        wrists = self._hands.read(lower.simulation.measured.projected_gravity)
        memory, guidance = lower.memory, lower.guidance
        target = guidance.references.wrist_target(memory.posture, memory.command, guidance.grasp)
        self._wrist_error = wrists - target
        late = self._decisions >= self._limit[self.drawn.task]
        end = ending(self._skill, self.now, held=held, happened=lower.happened, late=late)
        touched = self._in_wall()
        before, self._potential = self._potential, potential(self._skill, self.now, held)
        gained, costs = self._potential - before, self._costs * lower.period
        buffers["reward"][:] = reward(self._skill, gained, end, costs, self._jerk, touched)
        self._total += buffers["reward"]
        self._touched += touched
        buffers["terminated"][:], buffers["truncated"][:] = end.terminated, end.time_out
        self._observe()
        for name, _ in seen.sizes(self._skill):
            buffers[f"final/{name}"][:] = buffers[f"now/{name}"]
        which = np.flatnonzero(end.terminated | end.time_out)
        if len(which):
            self._write_figures(which, end)
            self._begin(which)
            self._observe()

    def _begin(self, which: Indices) -> None:
        """New episodes in some games, (k,)."""
        lower = self.lower
        self._episode[which] += 1
        key = random.absorb(self._keys[which], self._episode[which])
        lower.simulation.hold(self.drawn.draw(which, key), which)
        lower.wanted[which] = self._nominal.standing()[which]
        lower.start(which)
        self.origin.position[which] = lower.simulation.state.object_position[which]
        self.origin.heading[which] = lower.moved.heading[which]
        covered = np.zeros(self.n) if len(which) == self.n else self.now.covered.copy()
        covered[which] = 0.0
        self.now = self._situation(covered)
        self._potential[which] = potential(self._skill, self.now, ~self._pushing)[which]
        self._human.start(which)
        self._figures.start(which)
        for values in (self._decisions, self._touched, self._total, self._hands.felt, self._wrist_error):
            values[which] = 0
        for action in self._action.values():
            action[which] = 0.0
        self.buffers["human_acts"][:] = self.drawn.acts

    def _situation(self, covered: Array) -> GameState:
        lower = self.lower
        return situation(lower.simulation, lower.moved, self.origin, self.paths, self.drawn.task, covered)

    def _command(self, yaw: Array) -> Array:
        """Nominal commands, (n, 11); `yaw` (n,) of the objects as measured [rad]."""
        nominal = self._nominal
        by_rule = {
            "lead": nominal.leading(pursue(self._skill.pursuit, self.paths, self.now), self.now),
            "follow": nominal.following(self._hands.felt[:, -1].sum(axis=1), yaw),
            "clock": nominal.leading(self._open_loop_motion(1.0), self.now),
            "stand": nominal.standing(),
        }
        unaware = (self.drawn.rule == RULES.index("follow"))[:, None]
        self.buffers["privileged_action"][:] = nominal.action_of(by_rule["lead"], by_rule["follow"]) * unaware
        return np.stack([by_rule[rule] for rule in RULES])[self.drawn.rule, np.arange(self.n)]

    def _open_loop_motion(self, pace: Array | float) -> ObjectMotion:
        seconds = self._decisions / self._skill.frequency
        return open_loop_motion(self._skill.pursuit, self.paths, self.now, seconds, pace)

    def _costs_now(self) -> Array:
        """Internal force [N], absolute power of the human beyond its share [W] and tilt [rad], (3, n)."""
        state, drawn = self.lower.simulation.state, self.lower.simulation.drawn
        partner = state.partner_force
        robot = -state.grip_force.sum(axis=1)
        internal = internal_force(robot[:, :2], partner[:, :2])
        velocity = state.handle_velocity[:, :2]
        speed = np.linalg.norm(velocity, axis=1)
        needed = drawn["partner_share"] * drawn["rolling_resistance"] * speed
        power = np.abs(np.vecdot(partner[:, :2], velocity) - needed)
        heading = self.paths.heading(self.drawn.task, self.now.covered) + self.origin.heading
        along = np.stack([np.cos(heading), np.sin(heading)], axis=1)
        borne = [np.where(self._pushing, np.vecdot(f[:, :2], along), f[:, 2]) for f in (robot, robot + partner)]
        loads = np.stack(borne, axis=1)
        self._figures.add(self.now, internal, partner[:, :2], power, loads, self.lower.period)
        return np.stack([internal, power, self.now.tilt])

    def _in_wall(self) -> Mask:
        """Games in which a corner of the object is in a wall, (n,)."""
        task, now = self.drawn.task, self.now
        touched = np.zeros(self.n, np.bool_)
        for corner in range(len(CORNERS)):
            at = now.position[:, :2] + turned(self._corners[:, corner], now.yaw)
            covered, lateral = self.paths.place(task, at, now.covered)
            touched |= np.abs(lateral) > self.paths.half_width(task, covered)
        return touched

    def _observe(self) -> None:
        lower, drawn, now, ahead = self.lower, self.drawn, self.now, self._skill.pursuit.waypoints
        path, human_path = (seen.waypoints(self.paths, now, ahead, frame) for frame in (now.heading, now.yaw))
        thing = of_object(lower.simulation.measured, self._sees_object)
        robot = robot_observation(
            *(lower.memory.command, lower.simulation.measured, self._wrist_error, thing),
            *(self._pushing, drawn.known, path, self._hands.felt),
        )
        force = self.origin.turned(lower.simulation.state.partner_force)
        felt = seen.human_observation(now, force, self._action["human"], human_path)
        left = (self._limit[drawn.task] - self._decisions) / self._skill.frequency
        secret = seen.hidden(lower.simulation, lower.moved, left, drawn.acts)
        human = joined(felt)
        self._nominals = self._command(thing[:, YAW])
        self.buffers["now/robot"][:], self.buffers["now/human"][:] = robot, human
        self.buffers["now/state"][:] = np.concatenate([robot, human, joined(secret)], axis=1)

    def _write_figures(self, which: Indices, end: GameEnding) -> None:
        """Figures of the episodes that ended, (k,)."""
        drawn, simulation = self.drawn, self.lower.simulation
        ends = {name: happened[which] for name, happened in vars(end).items()}
        values = self._figures.read(which, self.lower.period) | ends
        values |= {
            "touched": self._touched[which] / self._skill.frequency,
            "covered": self.now.covered[which],
            "reward": self._total[which],
            "known": drawn.known[which],
            "mass": simulation.drawn["object_mass"][which],
            "share": simulation.drawn["partner_share"][which],
            "task": drawn.task[which],
            "partner": drawn.kind[which],
            "environment": self._games[which],
            "episode": self._episode[which],
        }
        self.buffers["figures"][which] = np.stack([values[name] for name in FIGURES], axis=1)
