"""What manifests say of cameras and tags."""
