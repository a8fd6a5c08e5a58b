"""A walking robot of one bent PVDF film, as two rigid links on a sprung hinge: how fast it runs over the frequency."""

import math

import numpy as np

from tarsus.measure import point_speed
from tarsus.validation import RowCase

FREQUENCIES = np.arange(160.0, 245.0, 5.0)  # Hz
SETTLED, END = 0.5, 1.5  # the way is taken between these times [s]

# The authors' model (github.com/justinyim/ISFMURSR-model @ bc411c9e, hingeModel.m)
FRONT_PIN, REAR_PIN = 7.5e-3, 6.25e-3  # from the centre of a link to the hinge [m]
FRONT_FOOT, REAR_FOOT = (2.5e-3, -3.5e-3), (-6.25e-3, -0.5e-3)  # from the centre, forward and up [m]
REST_ANGLE = 0.2  # between the links [rad]


def case(row, device):
    """One run a frequency: the fastest one, and the speed at that of the row."""
    several = [row.get("fastest_hz", 200.0), *FREQUENCIES]

    def read(*runs):
        speeds = [point_speed(run, "pin_x", SETTLED, END) for run in runs]
        fastest = FREQUENCIES[int(np.argmax(speeds[1:]))]
        return {"speed_cm_s": speeds[0], "fastest_hz": float(fastest), "free_free_hz": hinge_mode(device)}

    return RowCase([{"signals.hinge.frequency": float(one)} for one in several], read)


def hinge_mode(device):
    """Frequency of the mode that bends the hinge, off the ground [Hz]: the lowest that is no rigid motion."""
    found = device.robot.structure.matrices()
    squares = np.linalg.eigvals(np.linalg.solve(found.mass, found.stiffness)).real
    return float(np.sqrt(min(one for one in squares if one > 1.0))) / (2.0 * math.pi)


def turned(vector, angle):
    """A vector in the plane, turned upwards at its front end by an angle [rad]."""
    return (
        vector[0] * math.cos(angle) - vector[1] * math.sin(angle),
        vector[0] * math.sin(angle) + vector[1] * math.cos(angle),
    )


def standing():
    """Centre and foot of both links from the hinge [m], both feet level: where the device has them."""
    low, high = -0.5, 0.5
    for _ in range(60):
        pitch = 0.5 * (low + high)
        front, rear = places(pitch)
        low, high = (pitch, high) if front[1][1] < rear[1][1] else (low, pitch)
    return {"front": front[0], "front_foot": front[1], "rear": rear[0], "rear_foot": rear[1]}


def places(pitch):
    """Centre and foot of both links from the hinge, the front one pitched and the rear one by the rest angle more."""
    front = [turned(one, pitch) for one in ((FRONT_PIN, 0.0), (FRONT_PIN + FRONT_FOOT[0], FRONT_FOOT[1]))]
    rear = [turned(one, pitch + REST_ANGLE) for one in ((-REAR_PIN, 0.0), (-REAR_PIN + REAR_FOOT[0], REAR_FOOT[1]))]
    return front, rear
