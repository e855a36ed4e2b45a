"""From a problem to a labelled result: put a case together, solve it, run everything."""
