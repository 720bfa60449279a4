"""A PEM for other programs: its maps, its mesh, its pictures."""
