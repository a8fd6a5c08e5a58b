"""Sphinx configuration: `python -m sphinx -W docs docs/_build/html`."""

import sys
from importlib.metadata import version as installed_version
from pathlib import Path

import sphinx.ext.autosummary

sys.path.insert(0, str(Path(__file__).parent))
import names

# a summary ends with its first sentence, not at the full stop of a figure or an equation
sphinx.ext.autosummary.WELL_KNOWN_ABBREVIATIONS += ("Fig.", "Figs.", "Eq.", "Sec.", "No.")

project = "Tarsus"
copyright = "The Tarsus developers"
author = "The Tarsus developers"
version = release = installed_version("tarsus")

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.napoleon",
    "mathml",
    "fields",
    "names",
    "reference",
    "explorers",
    "terms",
]
myst_enable_extensions = ["dollarmath", "deflist"]
myst_update_mathjax = False
html_math_renderer = "mathml"
myst_heading_anchors = 3
source_suffix = {".rst": "restructuredtext", ".md": "myst-nb", ".ipynb": "myst-nb"}  # pages of names are the first
nb_execution_mode = "cache"  # notebooks are kept without outputs; each is run once until it changes
nb_execution_timeout = 600
nb_execution_raise_on_error = True
nb_merge_streams = True
exclude_patterns = ["_build", "jupyter_execute", "names.rst"]
templates_path = ["_templates"]
names.write_lists()
autosummary_generate = ["names.rst"]
autosummary_ignore_module_all = False
autodoc_typehints = "description"
autodoc_typehints_description_target = "documented"
napoleon_google_docstring = False
napoleon_numpy_docstring = True

html_domain_indices = False  # of modules: there is one that users name, and its page is in the reference
html_theme = "pydata_sphinx_theme"
html_title = "Tarsus"
html_static_path = ["_static"]
html_css_files = ["notebooks.css", "tarsus.css"]
html_theme_options = {"show_prev_next": False, "navbar_center": []}
html_sidebars = {"**": ["globaltoc"]}  # all pages on the left, in groups: the site is one level deep
