"""Oscillator with clearance: free motion, describing functions (Comparin and Singh 1989)."""
