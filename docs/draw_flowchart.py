"""Draw docs/flowchart.svg from the table of transitions that the engine goes by: `python docs/draw_flowchart.py`."""

from pathlib import Path

from tarsus.core.walk.states import NAMES, TRANSITIONS
from tarsus.report.flowchart import flowchart

TARGET = Path(__file__).with_name("flowchart.svg")


def drawing() -> str:
    """The picture's text."""
    return flowchart(TRANSITIONS, NAMES)


if __name__ == "__main__":
    TARGET.write_text(drawing(), encoding="utf-8", newline="\n")
