"""The hexapod's bouncing foot, fitted to the two measured scenarios of Table 3.2: six numbers, five unknowns, three
polarities. What they do not decide stays open, as a mixture."""

device = "hexapod"
table = "../data/table_3_2_hexapod.csv"
train = [1, 2]
conditions = ["wave", "volt_v", "gap_um"]

# All counts of the table are multiples of 20 in a second: one window of 50 ms, and a count within one in it.
measures = {
    "bounces": {"column": "bounces_exp_per_s", "unit": "1/s", "measure": "bounces_per_second", "counts": True,
                "relative": 0.1},
    "peak": {"column": "peak_exp_um", "unit": "um", "measure": "peak", "relative": 0.1},
    "mean": {"column": "mean_exp_um", "unit": "um", "measure": "mean_apex", "relative": 0.1},
}  # fmt: skip

unknowns = {
    "static": {"low": "1 um", "high": "15 um", "scale": "log", "unit": "m",
               "meaning": "static displacement of foot 1 for 10 V"},
    # One frequency for all scenarios. Three oscillations a step are seen, and several bounces a period (section 3.5):
    # with modes of 329 and 136 Hz that is 55 to 135 Hz, whether a step is a period or half of one.
    "frequency": {"low": "55 Hz", "high": "135 Hz", "unit": "Hz"},
    # Printed 0.51 on silicon, single impacts within 0.11 of it; the mean is known better.
    "restitution": {"low": 0.4, "high": 0.62, "paths": ["ground.restitution.coefficient"],
                    "prior": {"median": 0.51, "sd": 0.04}},
    # Factor of the damping of the printed matrices, whose rounding alone leaves a factor of up to five in single modes.
    "damping": {"low": 0.4, "high": 6.0, "scale": "log", "prior": {"median": 1.0, "factor": 2.0}},
    # Unit of the printed C_e and b_sfd over that of the printed matrices: neither is printed.
    "scale": {"low": 1e-4, "high": 1.0, "scale": "log"},
}  # fmt: skip

choices = {
    "polarity": {"options": ["pressing", "lifting", "both"],
                 "meaning": "What 10 V means is not printed: 0 to 10 V pressing the foot down, 0 to 10 V lifting it, "
                            "or -10 to 10 V."},
    "average": {"options": {"apex": {"mean": "mean_apex"}, "time": {"mean": "mean_height"}},
                "meaning": "What 'Avg. height' means is not printed: the mean of the flights' highest points, or the "
                           "mean over time."},
}  # fmt: skip

constraints = [
    {"name": "no contact at 20 um", "measure": "impacts", "max": 0, "softness": 0.1,
     "conditions": [{"volt_v": 10, "gap_um": 20, "wave": "sine"}, {"volt_v": 10, "gap_um": 20, "wave": "square"}],
     "reason": "At gaps of 20 to 40 um and 3 to 10 V the foot makes no contact (section 3.4.3): asked at the worst "
               "corner."},
    {"name": "two to four oscillations a step", "measure": "oscillations_per_step", "min": 1, "max": 4, "softness": 0.5,
     "conditions": [{"volt_v": 10, "gap_um": 10, "wave": "square"}],
     "reason": "About three oscillations a step are seen where the foot bounces (section 3.5); the measure's step is "
               "half a period, so that 1 to 4 holds whether a step is a period or half of one."},
    {"name": "no contact at 150 um and 30 V", "measure": "impacts", "max": 0, "softness": 0.1,
     "conditions": [{"volt_v": 30, "gap_um": 150, "wave": "sine"}],
     "reason": "Over 150 um the voltage was raised to 30 V 'without reaching the point of contact' (section 3.4.3): "
               "the swing in the air is bounded."},
]  # fmt: skip

sampling = {"settle": "0.2 s", "window": "50 ms", "windows": 6, "resolution": "0.1 um", "accuracy": 1e-6}
search = {"seed": 1, "population": 24, "prescreening": 256, "short": 6, "generations": 24, "spread": 400, "members": 24,
          "rejected": 1.8}  # fmt: skip

POLARITIES = {"pressing": (-1, 0.5, 0.5), "lifting": (1, 0.5, 0.5), "both": (1, 1, 0)}
"""Sign of the displacement, and amplitude and offset over the highest voltage."""
DAMPING = (0.002553195, 0.006302068, 0.00471986, 0.00363146, 0.003429172, 0.005262212)
"""Of the printed matrices."""


def changes(unknowns, row):
    """The drive of a polarity; forces of the ground and damping in the units that are searched."""
    sign, share, rest = POLARITIES[unknowns.polarity]
    return {
        "robot.feet.foot1.gap": f"{row['gap_um']} um",
        "signals.pzt": {"kind": row["wave"], "amplitude": share * row["volt_v"], "offset": rest * row["volt_v"],
                        "frequency": unknowns.frequency},
        "robot.drives.pzt.law.gain": sign * unknowns.static / 0.49324803 / 10,
        "ground.film.coefficient": 1e-12 * 2.132e-6 * unknowns.scale,
        "ground.electrostatic.coefficient": 1e-9 * 2.132e-6 * unknowns.scale,
        **{f"robot.structure.damping_ratios.{mode}": ratio * unknowns.damping for mode, ratio in enumerate(DAMPING)},
    }  # fmt: skip
