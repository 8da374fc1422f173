"""Docker Compose for robots: manifests in, a checked and running robot out."""

__version__ = "0.1.0"
