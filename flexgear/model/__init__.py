"""Cases: validated, frozen parameters in SI, read from TOML with units in keys."""
