"""Maps of what a robot does over two of its numbers: classes of settled motions, refined where they change.

The package is also the verb of its name, ``tarsus.atlas("cantilever", x=..., y=...)``.
"""

from tarsus.base.verb import callable_package

callable_package(__name__, "tarsus.atlas.verb:atlas")
