"""Objects: from a mesh file to a model that can be planned on."""
