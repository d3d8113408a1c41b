"""The backend `aided`: it knows which marker it looks for, and, where the system can tell, how large, how turned and where."""
