"""ISO 6336-6:2019, annex C: Miner's sum of a torque spectrum of 42 loaded bins."""
