"""Rolling bearings: load in rows of rolling elements, rating life, static safety."""
