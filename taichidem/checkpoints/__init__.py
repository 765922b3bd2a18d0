"""A run in a file, taken up where it stands: every row that changes, a procedure's answers, the schedule of writing."""
