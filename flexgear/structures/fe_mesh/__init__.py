"""FE meshes of rings, planets and carriers with named patches; only here are gmsh and meshio."""
