"""Rolling bearings by ISO/TS 16281:2008 (now ISO 16281:2025): load zones and a ball bearing."""
