"""Arms and commands to label: a scrambled Sobol sequence, with edges, nominal arms and mirror images."""

import numpy as np
from scipy.stats import qmc

from iowbc.arrays import Array, Indices
from iowbc.control.arms import ArmKinematics
from iowbc.recipe.generator import ReferenceGenerator
from iowbc.recipe.section import Interval
from iowbc.recipe.task.joint_references import ArmReference
from iowbc.reference.labels.support_model import Sample
from iowbc.robot.description import Robot
from iowbc.robot.mirror import interaction_mirror


class SamplePlan:
    """Samples by number; sample i depends only on the recipe and the seed.

    The drawn samples are followed by the grid of the feasible map, with two arm postures: the default one, which leans
    with the trunk, and one that keeps the wrists where they are ahead of an upright trunk, as wrist commands do.
    """

    def __init__(self, robot: Robot, recipe: ReferenceGenerator, seed: int) -> None:
        self.robot, self.recipe = robot, recipe
        sampling, region = recipe.sampling, recipe.feasible
        self.drawn = sampling.samples
        self.mirrored = int(sampling.mirrored_share * self.drawn)
        self.original = self.drawn - self.mirrored
        self.heights = np.linspace(sampling.height.low, sampling.height.high, region.heights)
        self.pitches = np.linspace(sampling.pitch.low, sampling.pitch.high, region.pitches)
        arms = robot.interaction
        self.rest, self.lower, self.upper = robot.default_position[arms], robot.lower[arms], robot.upper[arms]
        self.uniform_lower, self.uniform_upper = self.lower.copy(), self.upper.copy()
        names = [robot.joints[index] for index in arms]
        for name, interval in sampling.joint_ranges.items():
            place = names.index(name)
            self.uniform_lower[place], self.uniform_upper[place] = interval.low, interval.high
        self.kinematics = ArmKinematics(robot, ArmReference(posture_gain=0.0))
        self.mirror = interaction_mirror(robot)
        self.grid_arms = np.stack([np.tile(self.rest, (len(self.pitches), 1)), self._carrying()])
        self.grid_shape = (len(self.grid_arms), len(self.pitches), len(self.heights))
        default = float(np.clip(robot.default_height, self.heights[0], self.heights[-1]))
        self.nominal = default, float(np.clip(0.0, self.pitches[0], self.pitches[-1]))
        self.count = self.drawn + int(np.prod(self.grid_shape))
        dimensions, power = 2 + 2 + 6 + len(arms), int(np.ceil(np.log2(max(self.original, 2))))
        self.unit: Array = qmc.Sobol(dimensions, rng=np.random.default_rng(seed)).random_base2(power)

    def group(self, index: int) -> int:
        """Samples of one group are mirror images of each other and stay on one side of the held-out split."""
        return index - self.original if self.original <= index < self.drawn else index

    def draw(self, indices: Indices) -> list[Sample]:
        """The samples of these numbers; each depends on its own number only."""
        sources = np.unique([source for index in indices.tolist() if (source := self.group(index)) < self.original])
        unit = self.unit[sources.astype(np.int64)]
        commands = self._commands(unit)
        originals = dict(zip(sources.tolist(), map(Sample, self._arms(unit, commands), commands), strict=True))
        samples = []
        for index in indices.tolist():
            if index >= self.drawn:
                arms, row, column = np.unravel_index(index - self.drawn, self.grid_shape)
                command = np.array([self.heights[column], self.pitches[row]])
                samples.append(Sample(self.grid_arms[arms, row], command))
                continue
            sample = originals[self.group(index)]
            samples.append(sample if index < self.original else Sample(self.mirror(sample.arm), sample.command))
        return samples

    def _unbent(self, n: int) -> Array:
        """The waist's joints at zero, (n, joints)."""
        return np.zeros((n, len(self.robot.waist)))

    def _carrying(self) -> Array:
        """Arms that keep the wrists at their default place in the heading frame, one posture a pitch, (pitches, 14)."""
        wrist, _ = self.kinematics.forward(self.rest[None])
        upright, origin = self.kinematics.torso_in_heading(self._unbent(1), np.zeros(1))
        place = np.einsum("nij,nsj->nsi", upright, wrist) + origin[:, None]
        everywhere = np.repeat(place, len(self.pitches), axis=0)
        target = self.kinematics.into_torso(self._unbent(len(self.pitches)), self.pitches, everywhere)
        return self.kinematics.solve(np.tile(self.rest, (len(self.pitches), 1)), target)

    def _commands(self, unit: Array) -> Array:
        """Height and pitch, shape (n, 2); some moved onto an edge."""
        sampling = self.recipe.sampling
        command = np.stack([_scale(unit[:, 0], sampling.height), _scale(unit[:, 1], sampling.pitch)], axis=1)
        chooser = unit[:, 2]
        if sampling.boundary_share > 0.0:
            edge = np.floor(4.0 * chooser / sampling.boundary_share).astype(int)
            edges = (sampling.height.low, sampling.height.high, sampling.pitch.low, sampling.pitch.high)
            for number, value in enumerate(edges):
                command[edge == number, number // 2] = value
        return command

    def _arms(self, unit: Array, command: Array) -> Array:
        """Arm postures, shape (n, 14): nominal, by wrist positions in the heading or the torso frame, or uniform."""
        sampling, region = self.recipe.sampling, self.recipe.sampling.wrists
        chooser, place, turn = unit[:, 3], unit[:, 4:10], unit[:, 10:]
        arm = self.uniform_lower + turn * (self.uniform_upper - self.uniform_lower)
        nominal = chooser < sampling.nominal_share
        kind = (chooser - sampling.nominal_share) / max(1.0 - sampling.nominal_share, 1e-12)
        heading = ~nominal & (kind < sampling.heading_share)
        by_wrist = ~nominal & (kind < sampling.heading_share + sampling.torso_share)
        arm[nominal] = self.rest
        corner = np.stack([_scale(place[:, i], each) for i, each in enumerate((region.x, region.y, region.z))], axis=1)
        shift = region.asymmetry * (2.0 * place[:, 3:] - 1.0)
        target = np.stack([corner + shift, corner - shift], axis=1) * np.array([[1.0, 1.0, 1.0], [1.0, -1.0, 1.0]])
        leaning = self.kinematics.into_torso(self._unbent(len(unit)), command[:, 1], target)
        target = np.where(heading[:, None, None], leaning, target)
        start = np.clip(self.rest + region.redundancy * (2.0 * turn - 1.0), self.lower, self.upper)
        if by_wrist.any():
            arm[by_wrist] = self.kinematics.solve(start[by_wrist], target[by_wrist])
        return np.asarray(arm)


def _scale(unit: Array, interval: Interval) -> Array:
    """Numbers in [0, 1) spread over an interval."""
    return interval.low + unit * (interval.high - interval.low)
