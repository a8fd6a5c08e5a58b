"""The rarefied squeeze film on both sides of a comb's fingers, as one foot sees it."""

from tarsus import SmoothLaw, quantity


class CombFilm(SmoothLaw):
    """F = -C g' [Q(a)/a^3 + Q(b)/b^3] of the gas ahead of the fingers, a = g + ahead, and behind them, b = behind - g.

    Q(h) = 1 / (1 + 9.638 (path/h)^1.159) is Veijola's effective viscosity over that of a thick film, as in the
    library's `rarefied_film`.
    """

    coefficient: float = quantity("N m^2 s", "film coefficient of all fingers", ge=0.0)
    ahead: float = quantity("m", "gap ahead of a finger at contact", gt=0.0)
    behind: float = quantity("m", "gap behind a finger at contact", gt=0.0)
    free_path: float = quantity("m", "mean free path of the gas; 0 of a liquid", ge=0.0)

    @staticmethod
    def force(gap, gap_rate, volts, time, coefficient, ahead, behind, free_path):
        total = 0.0
        for film in (gap + ahead, behind - gap):
            total += 1.0 / (film * film * film * (1.0 + 9.638 * (free_path / film) ** 1.159))
        return -coefficient * gap_rate * total
