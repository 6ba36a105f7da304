"""What ROS packages contain, from the text of their files. Reads none itself."""
