"""Bodies: URDF and xacro to links and joints, lint, pictures, the frames of the body."""

IN_EVERY_ROBOT = True  # it has a component that runs in all of them
