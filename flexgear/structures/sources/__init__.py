"""Bodies by what they are made from: parameters, FE mesh or given matrices -> a reduced body."""
