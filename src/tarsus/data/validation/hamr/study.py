"""A trot of the packaged quadruped at a stride frequency: its mean speed."""

from tarsus.validation import RowCase


def case(row, device):
    """The device as it is packaged, at the frequency of the row."""
    return RowCase({"gait.frequency": row["hz"]}, lambda run: {"best_speed_m_s": run.measures["mean_speed"].value})
