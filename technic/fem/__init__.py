"""The mechanics of one part: stiffness, mass, rigid motions and port frames."""
