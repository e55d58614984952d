"""The figures beside the scene, as a small table."""

from html import escape
from math import isnan

from iowbc.live.moment import Moment
from iowbc.live.track import WINDOW, TrackFigures

UNITS = {"E_v": "m/s", "E_psi": "rad", "E_alpha": "rad", "E_h": "m"}
SYMBOLS = {"E_v": "E<sub>v</sub>", "E_psi": "E<sub>ψ</sub>", "E_alpha": "E<sub>α</sub>", "E_h": "E<sub>h</sub>"}
CELL = "padding:0 0.6em 0 0;text-align:right"
NAME = "padding:0 0.6em 0 0;text-align:left"


def figures(moment: Moment, readings: TrackFigures) -> str:
    """The command and the state at a moment, and the errors of the seconds before."""
    signals = moment.signals
    going, wanted = signals["system_velocity"], signals["commanded_velocity"]
    rows = [
        ("forward", wanted[0], going[0], "m/s"),
        ("left", wanted[1], going[1], "m/s"),
        ("height", signals["height_command"][0], signals["pelvis_height"][0], "m"),
        ("lean", signals["torso_pitch_command"][0], signals["torso_pitch"][0], "rad"),
    ]
    asked = [_row(name, f"{first:+.2f}", f"{second:+.2f} {unit}") for name, first, second, unit in rows]
    errors = [_row(SYMBOLS[name], f"{readings.errors[name]:.3f} {unit}") for name, unit in UNITS.items()]
    hands = "–" if isnan(readings.weight_in_hands) else f"{100 * readings.weight_in_hands:.0f} %"
    worst = sorted(readings.saturated.items(), key=lambda pair: -pair[1])
    limits = ", ".join(f"{escape(name.removesuffix('_joint'))} {100 * share:.0f} %" for name, share in worst)
    return (
        f"<div style='padding:0 1em;font-size:0.8em'><table>{_row('', 'command', 'is')}{''.join(asked)}</table>"
        f"<p style='margin:0.4em 0'>Means of the last {WINDOW:g} s:</p><table>{''.join(errors)}"
        f"{_row('weight in the hands', hands)}</table>"
        f"<p style='margin:0.4em 0'>Joints at their torque limit: {limits or 'none'}</p></div>"
    )


def _row(name: str, *values: str) -> str:
    return f"<tr><td style='{NAME}'>{name}</td>" + "".join(f"<td style='{CELL}'>{v}</td>" for v in values) + "</tr>"
