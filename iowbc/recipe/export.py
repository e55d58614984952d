"""The ONNX graph, its checks, and the trial that accepts the exported controller."""

from collections.abc import Iterator

from pydantic import Field

from iowbc.recipe.evaluation.sequences import Segment
from iowbc.recipe.section import COSMETIC, LATER, Section
from iowbc.recipe.simulation.holding import ObjectScene


class Acceptance(Section):
    """A short trial of the exported controller in the simulation; a gate of the stage."""

    scene: ObjectScene = "lift"
    """Scene of `simulation.scenes`, with an object."""
    mass: float = Field(default=4.0, ge=0)
    """Object mass [kg]; 0 is played in the scene without an object."""
    partner_share: float = Field(default=0.0, ge=-1, le=1)
    """Share of the weight that the partner bears; 0 leaves all of it to the robot."""
    sequence: tuple[Segment, ...] = Field(default=(Segment(duration=10.0, ramp=0.0),), min_length=1)
    """Commands of the trial, in order; standing by default."""
    trials: int = Field(default=5, ge=1, le=10_000)
    """Number of trials."""
    seed: int = Field(default=2000, ge=0, lt=2**32)
    """Seed of the first trial."""
    weight_in_hands: float = Field(default=0.95, ge=0, le=1)
    """Part of a held object's weight, less the partner's share, that must rest in the hands on average; the rest lies
    on thighs or torso."""
    transport: float = Field(default=0.5, ge=0, le=1)
    """Part of the commanded displacement that robot and object must cover, where the commands ask for any."""
    object_beside: float = Field(default=0.35, gt=0, json_schema_extra=LATER)
    """A pushed object that is ever further than this to the robot's side while it is to walk is lost [m]."""
    minimum: int = Field(default=1, ge=0)
    """Trials that must be survived with the object carried and transported, or the stage fails; 0 only reports."""

    def problems(self) -> Iterator[tuple[str, str]]:
        if self.minimum > self.trials:
            yield "", f"minimum {self.minimum} exceeds the {self.trials} trials"


class Export(Section):
    """The ONNX graph and its checks."""

    opset: int = Field(default=18, ge=18, le=23)
    """ONNX operator set; 18 runs on every onnxruntime since 1.14."""
    parity_tolerance: float = Field(default=1e-5, gt=0)
    """Largest difference between torch and onnxruntime over the golden vectors [rad, action units]."""
    target_tolerance: float = Field(default=1e-3, gt=0)
    """Largest difference between the controller's joint targets and those that the simulation computes for the same
    action [rad]; both round differently, by some 1e-6."""
    golden_steps: int = Field(default=100, ge=1, le=100_000)
    """Control steps of the rollout whose inputs and outputs are kept as golden vectors."""
    timing_steps: int = Field(default=500, ge=1, le=1_000_000, json_schema_extra=COSMETIC)
    """Inferences timed for the report."""
    acceptance: tuple[Acceptance, ...] = (Acceptance(),)
    """The trials that accept the exported controller, all of which must pass; empty leaves them out."""
