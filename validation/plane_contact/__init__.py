"""Plane contact of two whole gears by finite elements: reference for loaded tooth contact."""
