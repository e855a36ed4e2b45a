"""flexgear: dynamics of planetary gear stages whose ring gear, carrier and sun shaft bend."""

__version__ = "0.1.0"
