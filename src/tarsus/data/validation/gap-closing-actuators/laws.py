"""Comb of fingers that close a gap: attraction by two electrodes with fringe, rarefied squeeze film on both sides."""

import math

from tarsus import SmoothLaw, quantity


class CombAttraction(SmoothLaw):
    """F = -C V^2 [1/f^2 + 1/(pi t f) - 1/b^2], with the gaps f in front of a finger and b behind it.

    C is half the permittivity times the area of all fingers; the second term is the fringe of two plates as high as t
    (Palmer's capacitance, C per length eps t/f [1 + f/(pi t) (1 + ln(2 pi t/f))], differentiated).
    """

    coefficient: float = quantity("N m^2/V^2", "half the permittivity times the area of all fingers", ge=0.0)
    front: float = quantity("m", "gap in front of a finger at contact", gt=0.0)
    behind: float = quantity("m", "gap behind a finger at contact", gt=0.0)
    height: float = quantity("m", "height of the fingers", gt=0.0)

    uses_rate = False
    needs_electrode = True

    @staticmethod
    def force(gap, gap_rate, volts, time, coefficient, front, behind, height):
        ahead = gap + front
        back = behind - gap
        pull = 1.0 / (ahead * ahead) + 1.0 / (math.pi * height * ahead) - 1.0 / (back * back)
        return -coefficient * volts * volts * pull


class CombFilm(SmoothLaw):
    """F = -C g' [Q(f)/f^3 + Q(b)/b^3] of the air in front of the fingers and behind them.

    Q(h) = 1 / (1 + 9.638 (path/h)^1.159) takes off what molecules slip along the walls (T. Veijola and others, Sensors
    and Actuators A 48 (1995) 239-248); path is their mean free path.
    """

    coefficient: float = quantity("N m^2 s", "film coefficient of all fingers", ge=0.0)
    front: float = quantity("m", "gap in front of a finger at contact", gt=0.0)
    behind: float = quantity("m", "gap behind a finger at contact", gt=0.0)
    path: float = quantity("m", "mean free path of the gas; 0 of a liquid", ge=0.0)

    @staticmethod
    def force(gap, gap_rate, volts, time, coefficient, front, behind, path):
        ahead = gap + front
        back = behind - gap
        before = 1.0 / (ahead * ahead * ahead * (1.0 + 9.638 * (path / ahead) ** 1.159))
        after = 1.0 / (back * back * back * (1.0 + 9.638 * (path / back) ** 1.159))
        return -coefficient * gap_rate * (before + after)
