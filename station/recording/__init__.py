"""`alight recording`: what can be done with a recording besides flying it again."""
