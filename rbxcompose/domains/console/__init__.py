"""The console in a browser, and the gateway by which it and clients of rosbridge reach the robot."""
