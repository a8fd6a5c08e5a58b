"""Results as tables: one class, shown as console text, HTML, CSV and plain data, and how numbers are written in them.

Every result of the library has a method ``table()``; `Table` has the four forms. Numbers with units are written by
`amount`, `percent`, `interval` and `number` of `tarsus.tables.numbers`, here and wherever else people read them.
"""

from tarsus.tables.numbers import MISSING, amount, interval, number, percent, spaced
from tarsus.tables.section import Section
from tarsus.tables.table import Column, Table

__all__ = ["MISSING", "Column", "Section", "Table", "amount", "interval", "number", "percent", "spaced"]
