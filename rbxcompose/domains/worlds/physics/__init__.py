"""A robot and its world in MuJoCo, with mass, friction and contacts; it is the extra `physics`, imported when used."""
