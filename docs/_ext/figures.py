"""Pictures of the examples: what they call ``figure``, whoever made it."""

from sphinx_gallery.scrapers import figure_rst


def scraper(block, block_vars, gallery_conf):
    """Save the figure that a block left, if it is a new one; the reStructuredText that shows it."""
    figure = block_vars["example_globals"].get("figure")
    if figure is None or getattr(figure, "shown_in_gallery", False):
        return ""
    figure.shown_in_gallery = True
    path = next(block_vars["image_path_iterator"])
    figure.savefig(path, dpi=110)
    return figure_rst([path], gallery_conf["src_dir"])
