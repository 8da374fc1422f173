"""Trees of BehaviorTree.CPP: its nodes, its scripts, and missions made from them and into them."""
