"""`tarsus reproduce`: the dissertation's experiments row by row: its model, the measurement, ours."""

from tarsus.cli.line import line_of
from tarsus.cli.verb import Verb

FUNCTION = "tarsus_reproduce.verb:reproduce"
"""What `tarsus.reproduce` is in Python."""

reproduce = line_of(
    Verb(FUNCTION, words=1, files="tarsus_reproduce.interpretations:FILES", title="reproducing"), "reproduce"
)
