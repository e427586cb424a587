"""The linear model: sections, unsteady aerodynamics, and the door of the analyses."""
