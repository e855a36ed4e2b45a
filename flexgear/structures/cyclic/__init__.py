"""Reduction of bodies of equal sectors: one sector is factored, a Fourier transform joins all."""
