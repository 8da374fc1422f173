"""JSON Schemas of the manifests, made from the models, the registry of components and the kinds of mission nodes."""
