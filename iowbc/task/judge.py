"""Evaluates a control step: the motion, whether the episode ends (falls, drops, lag, divergence), and the reward."""

from dataclasses import dataclass

import numpy as np

from iowbc.arrays import Array, Mask, as_slice
from iowbc.control import gait
from iowbc.control.command import PITCH, VELOCITY, YAW_RATE
from iowbc.recipe.recipe import Recipe
from iowbc.recipe.task.task import Termination
from iowbc.robot.description import Robot
from iowbc.robot.rotations import wrapped
from iowbc.sim.state import SimulationState
from iowbc.task.curriculum import FULL_RANGE_LEVEL, LOCOMOTION
from iowbc.task.episode_state import EpisodeState
from iowbc.task.motion import Motion, low_pass
from iowbc.task.rewards.reward import RewardFunction
from iowbc.task.rewards.table import Step
from iowbc.task.rewards.terms import progress
from iowbc.task.yielding import Admittance, excess_force


@dataclass(frozen=True)
class Ending:
    """Reasons for which episodes end in a step, each (n,). A diverged one is neither fallen, dropped nor lagging."""

    fallen: Mask
    dropped: Mask
    lagging: Mask
    time_limit: Mask
    diverged: Mask

    @property
    def failed(self) -> Mask:
        """Fell, dropped the object, or did not follow the command."""
        return self.fallen | self.dropped | self.lagging

    @property
    def done(self) -> Mask:
        """Ended for any reason."""
        return self.failed | self.time_limit | self.diverged

    @property
    def truncated(self) -> Mask:
        """Reached the time limit without failing or diverging."""
        return self.time_limit & ~(self.failed | self.diverged)

    def reasons(self) -> dict[str, Mask]:
        """Exactly one reason for each episode that ended."""
        return {
            "fallen": self.fallen,
            "dropped": self.dropped & ~self.fallen,
            "lagging": self.lagging & ~(self.fallen | self.dropped),
            "time_limit": self.truncated,
            "diverged": self.diverged,
        }


@dataclass(frozen=True)
class Judgement:
    """Result of a control step of n environments."""

    motion: Motion
    ending: Ending
    terms: Array
    """Each term's part of the reward, in the order of `term_names`, (n, terms)."""
    tracking: Array
    """Scores of the terms `TRACKED`, between 0 and 1, (n, tracked)."""
    heading_error: Array
    """Heading less its reference, (n,) [rad]."""


class Judge:
    def __init__(self, recipe: Recipe, robot: Robot, holding: Mask, *, training: bool) -> None:
        """`holding`: environments that begin with an object in the hands, (n,); `training`: execute user-defined reward
        terms, and end the episodes of robots that lag behind the command or lose their crate."""
        self._task, self._height = recipe.task, recipe.rg.height
        self._support, self._lateral = as_slice(robot.support), robot.lateral
        self._holding, self._training, self._period = holding, training, 1.0 / recipe.task.control_frequency
        self._reward = RewardFunction(recipe.task.reward, self._period, own=training)
        self._admittance = Admittance(recipe.task.reward.yielding, holding)

    def motion(self, state: SimulationState) -> Motion:
        return Motion(state, self._height)

    def judge(
        self,
        state: SimulationState,
        memory: EpisodeState,
        action: Array,
        *,
        place: Array,
        disturbed: Mask,
        resistance: Array,
    ) -> Judgement:
        """Evaluates the last step, made with an action (n, 15). `place`: target position of a held object, (n, 3) [m];
        `disturbed`: whether an impulse or a push acted, (n,); `resistance`: rolling resistance of a crate, (n,) [N]."""
        moved = self.motion(state)
        self._filter(memory, moved, resistance * (1.0 - state.partner_share))
        error = wrapped(moved.heading - memory.heading_reference)
        target = self._admittance.velocity(memory.command[:, :YAW_RATE], memory.excess_force)
        self._follow(memory, target, error, disturbed)
        pushed = state.has_object & ~self._holding
        ending = self._ending(state, memory, moved, place, error, pushed)
        foot_phase, stance = gait.foot_phase(memory.phase), self._task.references.gait.stance
        step = Step(
            state=state,
            motion=moved,
            recipe=self._task.reward,
            support=self._support,
            lateral=self._lateral,
            command=memory.command,
            target_velocity=target,
            unyielded_force=self._admittance.unyielded(memory.command[:, :YAW_RATE], memory.excess_force),
            height_rate=memory.height_rate,
            support_reference=memory.support,
            filtered_velocity=memory.filtered_velocity,
            heading_error=error,
            action=action,
            previous_action=memory.action,
            earlier_action=memory.earlier_action,
            swing_profile=gait.swing_height(gait.swing_progress(foot_phase, stance), self._task.references.gait),
            stepping=memory.stepping,
            commanded=gait.wants_to_move(memory.command, self._task.references.gait),
            stance=gait.expected_stance(foot_phase, memory.stepping, stance),
            held=self._holding & state.grasped.any(axis=1),
            pushed=pushed,
            object_place=place,
            ended=ending.failed,
        )
        terms, tracking = self._reward(step, ending.diverged, memory.played[:, LOCOMOTION])
        memory.earlier_action[:], memory.action[:] = memory.action, action
        return Judgement(moved, ending, terms, tracking, error)

    def _filter(self, memory: EpisodeState, moved: Motion, resistance: Array) -> None:
        """Low-passes velocities, and the hand force beyond the robot's share of a crate's `resistance` (n,) [N]."""
        velocity = np.column_stack([moved.system_velocity[:, :YAW_RATE], moved.yaw_rate])
        time_constant = self._task.reward.sync.filter_time
        memory.filtered_velocity[:] = low_pass(memory.filtered_velocity, velocity, time_constant, self._period)
        if not self._admittance.idle:
            needed = np.where(memory.infeasible, 0.0, resistance)
            force = excess_force(moved.hand_force, memory.command[:, :YAW_RATE], needed)
            memory.excess_force[:] = low_pass(memory.excess_force, force, time_constant, self._period)

    def _follow(self, memory: EpisodeState, target: Array, error: Array, disturbed: Mask) -> None:
        """Adds a step to the sums of the episode; `target`: velocity, heading frame, (n, 2) [m/s]; `error` of heading,
        (n,) [rad]."""
        period, speed = self._period, np.hypot(target[:, 0], target[:, 1])
        along = progress(memory.filtered_velocity[:, :YAW_RATE], target)
        memory.walked += memory.command[:, VELOCITY].any(axis=1)
        memory.commanded += speed * period
        memory.covered += along * period
        memory.heading_error += np.abs(error)
        memory.undisturbed[:] = np.where(disturbed, 0, memory.undisturbed + 1)

    def _ending(
        self, state: SimulationState, memory: EpisodeState, moved: Motion, place: Array, error: Array, pushed: Mask
    ) -> Ending:
        termination, diverged = self._task.termination, state.diverged.copy()
        followable = ~pushed & (memory.played[:, LOCOMOTION] <= FULL_RANGE_LEVEL) & self._training
        left = lost(moved, place, pushed & self._training, termination)
        return Ending(
            fallen=fallen(moved, memory.command[:, PITCH], termination) & ~diverged,
            dropped=(dropped(moved, place, self._holding, state.grasped, termination) | left) & ~diverged,
            lagging=lagging(error, followable, termination) & ~diverged,
            time_limit=memory.steps >= memory.limit,
            diverged=diverged,
        )


def fallen(motion: Motion, pitch_command: Array, termination: Termination) -> Mask:
    """Base or torso beyond the limits, (n,); pitch_command (n,) [rad]."""
    return (
        (motion.pelvis_height < termination.pelvis_height)
        | (motion.pelvis_tilt > termination.pelvis_tilt)
        | (np.abs(motion.torso_roll) > termination.torso_roll)
        | (np.abs(motion.torso_pitch - pitch_command) > termination.torso_pitch_error)
    )


def lagging(heading_error: Array, followable: Mask, termination: Termination) -> Mask:
    """Too far from the commanded heading, (n,): heading error (n,) [rad], where the command can be followed."""
    limit = np.inf if termination.heading_error is None else termination.heading_error
    return (np.abs(heading_error) > limit) & followable


def dropped(motion: Motion, place: Array, held: Mask, grasped: Mask, termination: Termination) -> Mask:
    """A held object out of both hands, or too far from its place in the grasp, (n,). place: the object's place from the
    base, heading frame, (n, 3) [m]; grasped: hands that hold, (n, 2)."""
    distance = np.sqrt(np.square(motion.object_offset - place).sum(axis=1))
    return held & (~grasped.any(axis=1) | (distance > termination.object_distance))


def lost(motion: Motion, place: Array, pushed: Mask, termination: Termination) -> Mask:
    """A pushed object too far to the side of the hands, (n,); place: their middle from the base, heading frame, (n, 3)
    [m]."""
    if termination.object_beside is None:
        return np.zeros(len(pushed), np.bool_)
    return pushed & (np.abs(motion.object_offset - place)[:, 1] > termination.object_beside)
