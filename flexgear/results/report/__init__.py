"""What a report says of a run: verdicts and tables in words and units that a person uses."""
