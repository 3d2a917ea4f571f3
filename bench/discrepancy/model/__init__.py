"""The nominal model as the fits see it: coordinates, elements, forces, and where an effect can be placed."""
