"""Studies: sequences of analyses over one case, and the results they leave."""
