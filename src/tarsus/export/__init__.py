"""A scene carried to other tools, each with what is lost on the way; one file a tool.

The package is also the verb of its name, ``tarsus.export("cantilever", "mjcf", "out")``.
"""

from tarsus.base.verb import callable_package

callable_package(__name__, "tarsus.export.verb:export")
