"""Closed-form gear theory: geometry, kinematics, paths of contact, pair stiffness, errors."""
