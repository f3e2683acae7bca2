"""The documentation site: `make docs` builds it into build/docs, warnings being errors."""

import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent)]

import drillctl  # noqa: E402

project = "drillctl"
author = "The drillctl developers"
version = release = drillctl.__version__

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx_copybutton",
    "site_math",
    "site_commands",
    "site_outside",
    "site_surface",
    "site_tables",
]
source_suffix = {".md": "markdown"}

# The pages are read on a forge as well: only what shows there too.
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 4

autodoc_member_order = "bysource"
autodoc_typehints = "none"  # the docstrings give types with shapes and units
autodoc_default_options = {"members": True}
napoleon_google_docstring = False
napoleon_use_param = False  # types are words, `ndarray, shape (n,)`, and no names to link
napoleon_use_rtype = False
napoleon_custom_sections = [("Attributes", "params_style")]  # told once, with the class
default_role = "code"  # docstrings write names in single backquotes, as Markdown does

html_theme = "furo"
html_title = "drillctl"
html_math_renderer = "mathml"
html_show_copyright = False  # LICENSE says it
html_copy_source = False
html_show_sourcelink = False
html_static_path = ["_static"]
html_css_files = ["site.css"]
copybutton_prompt_text = r"\$ "
copybutton_prompt_is_regexp = True
pygments_style = "a11y-high-contrast-light"  # of furo's accessible-pygments
pygments_dark_style = "a11y-high-contrast-dark"
