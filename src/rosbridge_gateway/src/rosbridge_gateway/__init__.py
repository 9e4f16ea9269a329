"""The web-socket door of a ROS graph: rosbridge v2, rosapi, roles, audit; it knows no robot."""
