"""Contact of a spur planet and ring segment in three dimensions by CalculiX."""
