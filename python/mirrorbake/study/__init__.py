"""Studies: what each approximation costs and how far off it is, measured in one run."""
