"""The manual: `make docs` makes plain files in docs/_build that need no network."""

import os
import sys
from pathlib import Path

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE / "_ext")]
os.environ.setdefault("MPLBACKEND", "Agg")

import flexgear  # noqa: E402

project = "flexgear"
author = project_copyright = "The flexgear authors"
release = version = flexgear.__version__
extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.viewcode",
    "sphinx_gallery.gen_gallery",
    "mathml",
    "key_reference",
    "result_reference",
    "validation_report",
]
exclude_patterns = ["_build", "_ext", "examples"]
myst_enable_extensions = ["dollarmath"]
myst_fence_as_directive = ["math"]
myst_heading_anchors = 4
suppress_warnings = ["config.cache"]
highlight_language = "none"  # of blocks that name no language
html_theme = "furo"
html_title = f"flexgear {release}"
html_math_renderer = "mathml"
html_copy_source = False
autodoc_typehints = "description"
autodoc_member_order = "bysource"
autodoc_class_signature = "separated"
sphinx_gallery_conf = {
    "examples_dirs": "examples",
    "gallery_dirs": "gallery",
    "filename_pattern": r"/plot_",
    "image_scrapers": ("figures.scraper",),
    "abort_on_example_error": True,
    "download_all_examples": False,
    "show_memory": False,
    "write_computation_times": False,  # a page that would ask a network for scripts
    "within_subsection_order": "FileNameSortKey",
    "remove_config_comments": True,
}
