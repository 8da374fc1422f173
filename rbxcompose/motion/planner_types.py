"""The planners that a manifest may name."""

AUTOMATIC, FAST = "automatic", "fast"
"""Ours where numba is installed, then the first of OMPL's below; and ours, which has to be there."""
OMPL = {
    "rrt_connect": "RRTConnect",
    "rrt": "RRT",
    "rrt_star": "RRTstar",
    "informed_rrt_star": "InformedRRTstar",
    "aorrtc": "AORRTC",
    "bit_star": "BITstar",
    "bkpiece": "BKPIECE1",
    "kpiece": "KPIECE1",
    "lbkpiece": "LBKPIECE1",
}
"""OMPL's classes, by the names in manifests. SBL, EST and TRRT are not in its wheels, and PRM cannot be interrupted."""
PLANNERS = (AUTOMATIC, FAST, *OMPL)


def ompl_planner(name: str) -> str:
    """Return the planner of OMPL that searches when our own found nothing, or is not there."""
    return next(iter(OMPL)) if name in (AUTOMATIC, FAST) else name
