"""Lin & Parker 1999, natural modes of a planetary gear, DOI 10.1115/1.2893982."""
