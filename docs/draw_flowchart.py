"""Draw docs/flowchart.svg from the table of transitions that the engine goes by: `python docs/draw_flowchart.py`."""

from pathlib import Path

from tarsus.base.events import TRANSITIONS, FootState
from tarsus.report.flowchart import flowchart

TARGET = Path(__file__).with_name("flowchart.svg")


def drawing() -> str:
    """The picture's text."""
    return flowchart(TRANSITIONS, {state: state.words for state in FootState})


if __name__ == "__main__":
    TARGET.write_text(drawing(), encoding="utf-8", newline="\n")
