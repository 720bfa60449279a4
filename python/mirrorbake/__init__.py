"""Bakes the reflections of shiny objects into parameterized environment maps."""
