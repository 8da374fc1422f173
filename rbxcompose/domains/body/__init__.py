"""Bodies: URDF and xacro to links and joints, lint, pictures, the frames of the body."""
