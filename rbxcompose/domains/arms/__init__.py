"""Arms: kinematics, collisions, planning, picking and placing, the planning scene, heads."""
