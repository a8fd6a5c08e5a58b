"""A device fitted to a table of measures: every branch that fits, an ensemble in each, and what it predicts.

The package is also the verb of its name, ``tarsus.calibrate(study)``: whichever is imported first, both work.
"""

from __future__ import annotations

import sys
from types import ModuleType
from typing import Any


class _Verb(ModuleType):
    """A package that can be called."""

    def __call__(self, *args: Any, **options: Any) -> Any:
        from tarsus.calibrate.calibrating import calibrate

        return calibrate(*args, **options)


sys.modules[__name__].__class__ = _Verb
