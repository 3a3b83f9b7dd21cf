"""The documentation site: pages by hand, references generated from the code."""

import sys
from pathlib import Path

import fingersplit

sys.path.insert(0, str(Path(__file__).parent))

from generating import write_tables

GENERATED = Path(__file__).parent / "generated"

project = "Fingersplit"
project_copyright = "the Fingersplit contributors"
author = "the Fingersplit contributors"
release = fingersplit.__version__
extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx.ext.viewcode",
    "sphinx_copybutton",
    "mathml",
]
exclude_patterns = ["_build", "generated/*.md"]
myst_enable_extensions = ["dollarmath", "amsmath", "colon_fence", "deflist"]
myst_heading_anchors = 3
html_math_renderer = "mathml"
html_theme = "furo"
html_title = f"Fingersplit {release}"
autodoc_typehints = "description"
autodoc_member_order = "bysource"
napoleon_google_docstring = True
napoleon_numpy_docstring = False
napoleon_use_ivar = True
copybutton_prompt_text = "$ "
nitpicky = False

GENERATED.mkdir(exist_ok=True)
write_tables(GENERATED)
