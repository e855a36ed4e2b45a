"""The cache folder, which holds reduced bodies and other results that are expensive to compute."""

import os
from pathlib import Path


def cache_directory() -> Path:
    """The folder in $FLEXGEAR_CACHE, else flexgear's folder in the platform's cache directory."""
    chosen = os.environ.get("FLEXGEAR_CACHE")
    if chosen:
        return Path(chosen)
    from platformdirs import user_cache_path

    return user_cache_path("flexgear", appauthor=False)
