"""Bodies: FE meshes, matrices, reductions, and the lumped and beam bodies beside them."""
