"""Own data, own measure: the gap and the drive of a cantilever from three numbers that a function takes of its runs."""

import numpy as np

import tarsus as ts

truth = ts.with_values(ts.load_scene("cantilever", volts=8, hz=50), {"robot.feet.tip.gap": "71 um"})


def peaks(run):
    """Highest gap, mean gap and its standard deviation in the last period: the first two alone fit 78.7 um as well."""
    gap = run.states(np.linspace(0.04, 0.06, 200)).gap[0]
    return np.array([gap.max(), gap.mean(), gap.std()])


measured = peaks(ts.simulate(truth, 0.06))
unknowns = [
    ts.Unknown("robot.feet.tip.gap", "60 um", "80 um"),
    ts.Unknown("robot.drives.pzt.law.linear", "-1 uN/V", "-0.1 uN/V"),
]
result = ts.fit(truth, unknowns, lambda run: (peaks(run) - measured) / 1e-7, duration="60 ms")
if __name__ == "__main__":
    print(result)
