"""Settings of the site: ``sphinx-build -W -b html docs/site docs/_build``."""

import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parents[1])]

import reference_pages  # noqa: E402

project = "bolide"
author = "The bolide developers"
copyright = "the bolide developers"
extensions = ["myst_parser"]
myst_enable_extensions = ["dollarmath", "colon_fence", "deflist"]
myst_heading_anchors = 3
exclude_patterns = ["_build"]
html_theme = "furo"
html_title = "bolide"
html_copy_source = False
smartquotes = False
linkcheck_ignore = ["http"]


def setup(app):
    """Write the generated pages before Sphinx looks for sources."""
    reference_pages.write(HERE)
    app.add_css_file("wide.css")


html_static_path = ["_static"]
