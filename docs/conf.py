"""Configuration of the site of `make docs`: the pages of `docs/` and the notebooks, as one offline folder.

The sources lie in the root of the repository, so that links between pages, notebooks and files are the same here, in a
checkout and on a code host.
"""

import logging
import sys
from pathlib import Path

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE / "_site"), str(HERE.parent)]
logging.getLogger("arviz").setLevel(logging.WARNING)  # tells of its successors, for each import

project = "swimcal"
author = "the authors of swimcal"
project_copyright = "the authors of swimcal, MIT licence"
root_doc = "docs/index"
include_patterns = ["docs/**.md", "notebooks/*.ipynb", "datasets/*/CARD.md", "CONTRIBUTING.md", "CHANGELOG.md"]
exclude_patterns = [".venv", "build", ".git", "**/results"]

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx_copybutton",
    "site_pages",
]
myst_enable_extensions: list[str] = []  # pages read the same on a code host
myst_heading_anchors = 4
nb_execution_mode = "off"  # as committed; tests execute them
nb_ipywidgets_js: dict[str, dict[str, str]] = {}  # from a CDN otherwise
suppress_warnings = ["misc.highlighting_failure"]

default_role = "code"
smartquotes = False  # options are written with two hyphens
autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_typehints_format = "short"
autodoc_preserve_defaults = True
napoleon_numpy_docstring = False
napoleon_use_ivar = True
napoleon_custom_sections = ["Source"]
python_display_short_literal_types = True
python_maximum_signature_line_length = 90
add_module_names = False

html_theme = "furo"
html_title = "swimcal"
html_static_path = ["_site/static"]
html_css_files = ["site.css"]
html_extra_path = ["_site/extra"]
html_show_sphinx = False
html_copy_source = False
html_theme_options = {"navigation_with_keys": True}
copybutton_prompt_text = r">>> |\.\.\. |\$ "
copybutton_prompt_is_regexp = True
