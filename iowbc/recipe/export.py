"""The ONNX graph, its checks, and the acceptance trials of the exported controller."""

from pydantic import Field

from iowbc.recipe.evaluation.sequences import Segment
from iowbc.recipe.section import COSMETIC, LATER, Problems, Section
from iowbc.recipe.simulation.holding import ObjectScene


class Acceptance(Section):
    """Short acceptance trials of the exported controller in simulation; the stage fails if they do."""

    scene: ObjectScene = "lift"
    """Scene of `simulation.scenes`, with an object."""
    mass: float = Field(default=4.0, ge=0)
    """Object mass [kg]; 0: no object."""
    partner_share: float = Field(default=0.0, ge=-1, le=1)
    """Fraction of the weight that the partner bears; 0: the robot bears all of it."""
    sequence: tuple[Segment, ...] = Field(default=(Segment(duration=10.0, ramp=0.0),), min_length=1)
    """Commands of the trial, in order; standing by default."""
    trials: int = Field(default=5, ge=1, le=10_000)
    """Number of trials."""
    seed: int = Field(default=2000, ge=0, lt=2**32)
    """Seed of the first trial."""
    weight_in_hands: float = Field(default=0.95, ge=0, le=1)
    """Fraction of a held object's weight, less all external vertical forces, that must rest in the hands on average;
    the rest lies on thighs or torso."""
    transport: float = Field(default=0.5, ge=0, le=1)
    """Fraction of the commanded displacement, if any, that robot and object must cover."""
    object_beside: float = Field(default=0.35, gt=0, json_schema_extra=LATER)
    """Lateral distance from the robot beyond which a pushed object counts as lost while walking is commanded [m]."""
    minimum: int = Field(default=1, ge=0)
    """Smallest number of survived trials with the object carried and transported for the stage to succeed; 0: report
    only."""

    def problems(self) -> Problems:
        if self.minimum > self.trials:
            yield "", f"minimum {self.minimum} exceeds the {self.trials} trials"


class Export(Section):
    """The ONNX graph and its checks."""

    opset: int = Field(default=18, ge=18, le=23)
    """ONNX operator set; 18 runs on every onnxruntime since 1.14."""
    parity_tolerance: float = Field(default=1e-5, gt=0)
    """Largest difference between torch and onnxruntime over the golden vectors [rad, action units]."""
    target_tolerance: float = Field(default=1e-3, gt=0)
    """Largest difference between the joint targets of controller and simulation for the same action [rad]; rounding
    differs by some 1e-6."""
    golden_steps: int = Field(default=100, ge=2, le=100_000)
    """Control steps of the rollout whose inputs and outputs are kept as golden vectors; the first is not timed."""
    timing_steps: int = Field(default=500, ge=1, le=1_000_000, json_schema_extra=COSMETIC)
    """Number of inferences timed for the report."""
    acceptance: tuple[Acceptance, ...] = (Acceptance(),)
    """Acceptance trials of the exported controller; all must pass. Empty: none."""
