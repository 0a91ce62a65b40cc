"""The site: `make docs` builds it into build/docs, offline, with warnings as errors."""

from __future__ import annotations

import kiks

project = "KiKS"
copyright = "KiKS contributors"
version = release = kiks.__version__

extensions = ["myst_parser", "sphinx_copybutton", "sphinx_design"]
# What is for developers only, and texts that other pages include.
exclude_patterns = ["next.md", "pages"]
nitpicky = True

myst_enable_extensions = ["colon_fence"]
myst_heading_anchors = 3

html_theme = "furo"
html_title = f"KiKS {release}"
