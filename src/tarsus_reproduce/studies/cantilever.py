"""The micro-cantilever fitted to the measured column of Table A.1 (tarsus calibrate cantilever -o OUT)."""

from tarsus_reproduce.cantilever_studies import BREAKS_OFF, LANDING, drive_changes

device = "cantilever"
table = "../data/table_a1_cantilever.csv"
conditions = ["freq_hz", "volt_v", "wave"]

# Bounces in a drive period by the definition of conventions.md: any flight above 0.1 um after a short contact.
measures = {
    "bounces": {"column": "bounces_exp", "measure": "bounces", "absolute": 1, "existence": True},
    "peak": {"column": "peak_exp_um", "unit": "um", "measure": "peak", "relative": 0.08},
    "contact": {"column": "contact_exp_ms", "unit": "ms", "measure": "contact_duration", "relative": 0.12,
                "absolute": "0.5 ms"},
}  # fmt: skip

unknowns = {
    "static": {"low": 11.0, "high": 22.0, "meaning": "static tip deflection per drive force [um/uN]"},
    # A uniform bending moment along the beam has 0.011.
    "ratio": {"low": -0.25, "high": 0.25,
              "meaning": "static share of mode 2 in the tip deflection, relative to mode 1"},
    # Ratios of 0.5 to 5 % are usual for such structures; the source prints no damping.
    "zeta1": {"low": 0.004, "high": 0.12, "scale": "log", "paths": ["robot.structure.damping_ratios.0"],
              "prior": {"median": 0.02, "factor": 2.0}},
    "zeta2": {"low": 0.004, "high": 0.3, "scale": "log", "paths": ["robot.structure.damping_ratios.1"],
              "prior": {"median": 0.03, "factor": 3.0}},
    # Its size is the smaller half force swing of a 6 V loop by the printed branches (2.9), of which it is the zero.
    "offset": {"low": -2.2, "high": 0.6, "size": 3.3, "meaning": "zero of the drive force [uN]"},
    "swing": {"low": 2.8, "high": 4.2, "meaning": "half the force swing of a 6 V loop [uN]"},
    # Printed 0.378, the mean of 16 bounces that scatter (Fig. 2.5).
    "restitution": {"low": 0.1, "high": 0.7, "paths": ["ground.restitution.coefficient"],
                    "prior": {"median": 0.378, "sd": 0.08}},
    # Adhesion is printed in the force unit of lumped matrices that are not printed: free over decades.
    "initial": {"low": "2 nN", "high": "500 nN", "scale": "log", "paths": ["ground.adhesion.initial"]},
    "rate": {"low": "0.2 uN/s", "high": "6 uN/s", "scale": "log", "paths": ["ground.adhesion.rate"]},
}  # fmt: skip

choices = {"landing": LANDING}
constraints = [BREAKS_OFF]
sampling = {"settle": "0.2 s", "window": "0.2 s", "windows": 1, "resolution": "0.1 um", "accuracy": 1e-5}
search = {"seed": 1, "population": 24, "prescreening": 96, "short": 4, "generations": 16, "spread": 200, "members": 24,
          "rejected": 12}  # fmt: skip


def changes(unknowns, row):
    """The film is the printed one, which these rows do not determine."""
    return {
        **drive_changes(unknowns, row),
        "ground.film.coefficient": "1.747e-21 N m^2 s",
        "ground.film.thickness": "58 um",
    }
