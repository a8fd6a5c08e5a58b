"""The source's own model of the micro-cantilever: printed ground, and what is not printed fitted to the model column of
Table A.1 (tarsus calibrate cantilever-1 -o OUT). No row is left out: the column is a model's, repeated by this one."""

from tarsus_reproduce.cantilever_studies import BREAKS_OFF, LANDING, drive_changes

device = "cantilever-1"
table = "../data/table_a1_cantilever.csv"
conditions = ["freq_hz", "volt_v", "wave"]

# Bounces in a drive period by the definition of conventions.md: any flight above 0.1 um after a short contact.
measures = {
    "bounces": {"column": "bounces_sim", "measure": "bounces", "absolute": 0.5, "existence": True, "weight": 2.0},
    "peak": {"column": "peak_sim_um", "unit": "um", "measure": "peak", "relative": 0.1},
    "contact": {"column": "contact_sim_ms", "unit": "ms", "measure": "contact_duration", "relative": 0.12,
                "absolute": "0.5 ms", "weight": 2.0},
}  # fmt: skip

unknowns = {
    "static": {"low": 14.0, "high": 20.0, "prior": {"median": 16.0, "sd": 1.5},
               "meaning": "static tip deflection per drive force [um/uN]"},
    # A uniform bending moment along the beam has 0.011.
    "ratio": {"low": -0.1, "high": 0.1, "prior": {"median": 0.011, "sd": 0.03},
              "meaning": "static share of mode 2 in the tip deflection, relative to mode 1"},
    # Ratios of 0.5 to 5 % are usual for such structures; the source prints no damping.
    "zeta1": {"low": 0.004, "high": 0.06, "scale": "log", "paths": ["robot.structure.damping_ratios.0"],
              "prior": {"median": 0.02, "factor": 2.0}},
    "zeta2": {"low": 0.004, "high": 0.3, "scale": "log", "paths": ["robot.structure.damping_ratios.1"],
              "prior": {"median": 0.03, "factor": 3.0}},
    # Its size is the smaller half force swing of a 6 V loop by the printed branches (2.9), of which it is the zero.
    "offset": {"low": -2.2, "high": 0.6, "size": 3.3, "meaning": "zero of the drive force [uN]"},
    "swing": {"low": 2.8, "high": 4.2, "meaning": "half the force swing of a 6 V loop [uN]"},
    # Adhesion and film are printed in the force unit of lumped matrices that are not printed: all are scaled together.
    "scale": {"low": 0.001, "high": 1.0, "scale": "log",
              "meaning": "our force unit over that of the source's lumped matrices"},
}  # fmt: skip

choices = {"landing": LANDING}
constraints = [BREAKS_OFF]
sampling = {"settle": "0.2 s", "window": "0.2 s", "windows": 1, "resolution": "0.1 um", "accuracy": 1e-5}
# One search, for no row is left out, so that it may be longer than those that are made again for every row.
search = {"seed": 1, "population": 40, "prescreening": 512, "short": 8, "generations": 50, "spread": 400,
          "leave_out": False, "members": 24, "rejected": 3}  # fmt: skip


def changes(unknowns, row):
    """Adhesion and film by one scale."""
    return {
        **drive_changes(unknowns, row),
        "ground.adhesion.initial": 0.2743e-6 * unknowns.scale,
        "ground.adhesion.rate": 1.7e-6 * unknowns.scale,
        "ground.film.coefficient": 1.747e-21 * unknowns.scale,
    }
