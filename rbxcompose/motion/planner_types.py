"""The planners that a manifest may name."""

PLANNERS = {
    "rrt_connect": "RRTConnect",
    "rrt": "RRT",
    "bit_star": "BITstar",
    "bkpiece": "BKPIECE1",
    "kpiece": "KPIECE1",
    "lbkpiece": "LBKPIECE1",
}
"""OMPL's classes, by the names in manifests. SBL, EST and TRRT are not in its wheels, and PRM cannot be interrupted."""
