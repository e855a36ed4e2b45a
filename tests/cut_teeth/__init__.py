"""Teeth cut by brute force: a tool's outline in many positions, and what it leaves."""
