"""What verbs share: finding the robot that is meant, telling findings, telling the story of a run."""
