"""Numbers of the paper: Table II (lifting), Table III (pushing) and the heavy task of its section IV-B.

Source: H. Zhang, Y. Tseng, D. Zhao, H. E. Tseng, "Interaction-Aware Whole-Body Control for Compliant Object
Transport", tables `tab:lifting_huge` and `tab:pushing_huge`. None stands for the paper's "Fails".
"""

from typing import Literal

Errors = tuple[float, float, float, float]
"""E_alpha [rad], E_h [m], E_v [m/s], E_psi [rad], in the order of the paper's columns."""

VARIANTS = ("IO-WBC", "WBC", "w/o RG", "w/o Distill.")
"""The paper's names of the variants, in the order of its rows."""

LIFTING: dict[float, dict[str, Errors | None]] = {
    0.0: {
        "IO-WBC": (0.125, 0.015, 0.046, 0.134),
        "WBC": (0.126, 0.015, 0.047, 0.135),
        "w/o RG": (0.188, 0.051, 0.048, 0.403),
        "w/o Distill.": (0.184, 0.023, 0.177, 0.118),
    },
    4.0: {
        "IO-WBC": (0.132, 0.016, 0.048, 0.139),
        "WBC": (0.166, 0.034, 0.098, 0.158),
        "w/o RG": (0.458, 0.125, 0.185, 0.612),
        "w/o Distill.": (0.312, 0.075, 0.342, 0.205),
    },
    8.0: {"IO-WBC": (0.145, 0.018, 0.053, 0.150), "WBC": None, "w/o RG": None, "w/o Distill.": None},
}

PUSHING: dict[float, dict[str, Errors | None]] = {
    0.0: LIFTING[0.0] | {"w/o RG": (0.286, 0.049, 0.048, 0.413)},
    30.0: {
        "IO-WBC": (0.131, 0.016, 0.225, 0.143),
        "WBC": (0.211, 0.055, 0.356, 0.246),
        "w/o RG": (0.582, 0.165, 0.453, 0.785),
        "w/o Distill.": (0.323, 0.073, 0.386, 0.211),
    },
    60.0: {"IO-WBC": (0.152, 0.019, 0.486, 0.161), "WBC": None, "w/o RG": None, "w/o Distill.": None},
}

STAGNATING = 0.1
"""Rolling resistance μ from which crates of 60 kg hardly follow in our trials (E_v 0.26 m/s at 0.1, 0.35 at 0.15), as
in the paper's (0.486 m/s). The paper gives 0.02 to 0.15 for training and does not say with which it was tested."""

TABLES: dict[str, dict[float, dict[str, Errors | None]]] = {"lifting": LIFTING, "pushing": PUSHING}

TYRE_SUCCESS: dict[str, float] = {"IO-WBC": 0.8, "WBC": 0.0}
"""Success rate with the 18 kg tyre in the paper's real trials (4 of 5, and 0)."""


def reported(suite: str, mass: float, variant: str) -> Errors | Literal["absent"] | None:
    """The paper's errors for a suite, mass [kg] and variant; None for "Fails", "absent" if it has no such cell."""
    row = TABLES.get(suite, {}).get(mass, {})
    return row.get(variant, "absent")
