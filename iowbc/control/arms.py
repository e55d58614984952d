"""Both arms, many rows at once: forward kinematics, Jacobian, damped differential IK (paper eq. 2, 3), and the torques
with which they carry their own weight and a load in the hands: a feed-forward for their motors."""

import numpy as np

from iowbc.arrays import Array, Constants, namespace, stacked
from iowbc.control.chain import Chain, Frames, crossed, product, rotated, turn
from iowbc.recipe.task.joint_references import ArmReference
from iowbc.robot.description import GRAVITY, Robot

X, Y = 0, 1


def by_arm(values: Array) -> Array:
    """Rows of both arms' joints, (n, arm joints), as (joints of one, 2, n); `by_row` is the inverse."""
    xp = namespace(values)
    return xp.swapaxes(values.reshape(-1, 2, values.shape[-1] // 2), 0, 2)


def by_row(values: Array) -> Array:
    """Values (joints of one, 2, n) as rows (n, arm joints)."""
    return namespace(values).swapaxes(values, 0, 2).reshape(-1, 2 * values.shape[0])


class ArmKinematics(Constants):
    """Both arms from the torso frame to the wrist sites; joints as in the interaction branch, left, then right."""

    def __init__(self, robot: Robot, settings: ArmReference | None = None) -> None:
        torso = robot.tree.mover(robot.torso).name
        chains = [robot.tree.chain(body, torso) for body in robot.wrist_bodies]
        self._chain, self._waist = Chain(chains), Chain([robot.tree.chain(torso, robot.base)])
        self.settings = settings = settings or ArmReference()
        joints = robot.interaction
        speed = robot.velocity_limit[joints]
        speed = speed if settings.joint_speed is None else np.minimum(speed, settings.joint_speed)
        self.rest, self.lower, self.upper = robot.default_position[joints], robot.lower[joints], robot.upper[joints]
        rows = (self.rest, speed, self.lower, self.upper)
        self._rest, self._speed, self._lower, self._upper = (by_arm(values[None]) for values in rows)
        self._grip = robot.grip_offset.T[:, :, None]
        hinges = self._chain.length
        self._mass, self._moment = np.zeros((hinges, 1, 2, 1)), np.zeros((hinges, 3, 2, 1))
        for side, chain in enumerate(chains):
            for place, body in enumerate(body for body in chain if body.hinge is not None):
                self._mass[place, :, side], self._moment[place, :, side, 0] = robot.tree.rigid_mass(body.name)
        self._outward = np.cumsum(self._mass[::-1], axis=0)[::-1].copy()
        self._identity = np.eye(3)[:, :, None, None]

    def forward(self, arm_position: Array, frames: Frames | None = None) -> tuple[Array, Array]:
        """Wrists (n, 2, 3) [m] in the torso frame, and their Jacobian (n, 2, 3, joints of one); `frames` if known."""
        wrist, columns = self._reached(frames or self.frames(arm_position))
        xp = namespace(wrist)
        return xp.moveaxis(wrist, (0, 1, 2), (2, 1, 0)), xp.moveaxis(columns, (0, 1, 2, 3), (2, 3, 1, 0))

    def _reached(self, frames: Frames) -> tuple[Array, Array]:
        """Wrists (3, 2, n) [m] and their Jacobian (3, joints, 2, n)."""
        wrist = frames.end(self._grip)
        return wrist, frames.jacobian(wrist)

    def frames(self, arm_position: Array) -> Frames:
        """The hinges of both arms, of `arm_position` (n, arm joints) [rad]."""
        return self._chain.frames(by_arm(arm_position))

    def solve_step(self, arm_position: Array, target: Array, dt: float, frames: Frames | None = None) -> Array:
        """One step of differential IK (paper eq. 3), damped, with the redundancy drawn to the rest posture.

        `arm_position` (n, arm joints) [rad]; `target` wrists (n, 2, 3) [m], torso frame; `dt` [s]; `frames` if known.
        next = q + J⁺e + (1 - J⁺J) k (rest - q) dt with J⁺ = Jᵀ(JJᵀ + λ² + ρ|e|)⁻¹ and e = x - FK(q), limited in
        length; the result is clipped to joint ranges and joint speed.
        """
        xp, settings, position = namespace(arm_position), self.settings, by_arm(arm_position)
        wrist, columns = self._reached(frames or self._chain.frames(position))
        error = xp.swapaxes(target, 0, 2) - wrist
        distance = xp.sqrt((error * error).sum(0))
        error = error * (settings.longest_step / distance.clip(settings.longest_step, None))
        damping = settings.damping**2 + settings.reach * distance.clip(None, settings.longest_step)
        posture = settings.posture_gain * dt * (self._rest - position)
        wanted = error - (columns * posture).sum(1)
        step = posture + (columns * _solved(columns, self._identity * damping, wanted)[:, None]).sum(0)
        moved = position + step.clip(-self._speed * dt, self._speed * dt)
        return by_row(moved.clip(self._lower, self._upper))

    def solve(self, arm_position: Array, target: Array, *, steps: int = 60, dt: float = 0.1) -> Array:
        """Repeats `solve_step`: postures whose wrists are at, or as near as they get to, `target` (n, 2, 3)."""
        for _ in range(steps):
            arm_position = self.solve_step(arm_position, target, dt)
        return arm_position

    def torque(
        self, arms: Array, waist: Array, gravity: Array, load: Array | None = None, frames: Frames | None = None
    ) -> Array:
        """Motor torques that hold the arms still, (n, arms) [N·m], in the order of the interaction branch.

        `arms` (n, arms) and `waist` (n, waist joints) positions [rad], measured or reference; `gravity` (n, 3): its
        direction in the base frame, (0, 0, -1) when upright; `load` (n, 2), or (n, 1) where it is the same on both:
        mass that hangs on each grip point [kg]; `frames` of `arms`, where they are known.

        The torque of hinge i is -(a_i × Σ_k m_k (c_k - o_i))·g over the links k from i outward, with its axis a_i and
        origin o_i and the links' centres c_k; the load's part is Jᵀ of its weight.
        """
        xp, frames = namespace(arms), frames or self.frames(arms)
        down = GRAVITY * self._waist.inward(waist.T[:, None], gravity.T[:, None], directions=True)
        own = self._mass * frames.origin + rotated(frames.rotation, self._moment)
        mass, moments = self._outward, [own[-1]]
        if load is not None:
            mass = mass + load.T
            moments = [own[-1] + load.T * frames.end(self._grip)]
        for hinge in reversed(range(len(own) - 1)):
            moments.append(moments[-1] + own[hinge])
        lever = stacked(moments[::-1]) - mass * frames.origin
        torque = (crossed(xp.swapaxes(frames.axis, 0, 1), xp.swapaxes(lever, 0, 1)) * down[:, None]).sum(0)
        return by_row(-torque)

    def into_torso(self, waist: Array, pelvis_pitch: Array, points: Array) -> Array:
        """Points (n, k, 3) [m] of the heading frame at the base, in the torso frame; see `torso_in_heading`."""
        xp, cosine, sine = namespace(points), namespace(points).cos(pelvis_pitch), namespace(points).sin(pelvis_pitch)
        x, y, z = xp.swapaxes(points, 0, 2)
        at_pelvis = stacked([cosine * x - sine * z, y, sine * x + cosine * z])
        return xp.swapaxes(self._waist.inward(waist.T[:, None], at_pelvis), 0, 2)

    def torso_in_heading(
        self, waist: Array, pelvis_pitch: Array, pelvis_roll: Array | None = None
    ) -> tuple[Array, Array]:
        """Rotation (n, 3, 3) and position (n, 3) [m] of the torso frame in the heading frame at the base, for `waist`
        (n, waist joints), as in the chain, `pelvis_pitch` and `pelvis_roll` (n,) [rad]."""
        pelvis = turn(Y, pelvis_pitch[None])
        if pelvis_roll is not None:
            pelvis = product(pelvis, turn(X, pelvis_roll[None]))
        frames = self._waist.frames(waist.T[:, None], pelvis)
        return np.moveaxis(frames.rotation[-1, :, :, 0], -1, 0), frames.origin[-1, :, 0].T


def _solved(columns: Array, damping: Array, wanted: Array) -> Array:
    """(JJᵀ + damping)⁻¹ wanted by Cramer's rule, (3, 2, n), of a Jacobian (3, joints, 2, n), damping (3, 3, 2, n)."""
    matrix = (columns[:, None] * columns[None]).sum(2) + damping
    cofactors = crossed(matrix[:, [1, 2, 0]], matrix[:, [2, 0, 1]])
    return (cofactors * wanted[None]).sum(1) / (matrix[:, 0] * cofactors[:, 0]).sum(0)
