"""`tarsus reproduce`: compare with experiments of the dissertation row by row, then summarise; of several, write pages
with an index."""

from tarsus.cli.line import line_of
from tarsus.cli.verb import Verb

FUNCTION = "tarsus_reproduce.verb:reproduce"
"""What `tarsus.reproduce` is in Python."""

reproduce = line_of(Verb(FUNCTION, words=1, files="tarsus_reproduce.verb:FILES", title="reproducing"), "reproduce")
