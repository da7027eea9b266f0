"""The pages as a site: `sphinx-build docs site`. Words and pictures stand in the Markdown alone."""

project = "topleft"
author = "the topleft authors"
extensions = ["myst_parser"]
html_theme = "furo"
html_title = "topleft"
root_doc = "index"
exclude_patterns = ["README.md"]  # index.rst includes it
myst_heading_anchors = 4
# Links that leave the folder (CONTRIBUTING.md, sources) are for readers of the repository; tests/house/test_docs.py
# checks that all of them exist.
suppress_warnings = ["myst.xref_missing"]
