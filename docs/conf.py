"""The pages as a site: `sphinx-build docs site`. Words stand in the Markdown alone, their order in index.rst."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent / "site"))

project = "topleft"
author = "the topleft authors"
extensions = ["myst_parser", "gallery", "links", "live", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
autodoc_typehints = "none"  # docstrings have shapes, dtypes and units
autodoc_member_order = "bysource"
napoleon_google_docstring = False
napoleon_use_ivar = True
napoleon_use_rtype = False
suppress_warnings = ["ref.python"]  # `mesh` in the type of a parameter is no link
html_theme = "furo"
html_show_copyright = False
html_title = "topleft"
html_static_path = ["site/static"]
html_css_files = ["site.css"]
root_doc = "index"
source_suffix = {".rst": "restructuredtext", ".md": "markdown", ".txt": "markdown"}  # .txt: site/links.py
exclude_patterns = ["README.md", "guide/examples.md", "site"]  # other pages show them
myst_heading_anchors = 4
